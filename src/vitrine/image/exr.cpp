#include "base/file.h"
#include "image/image_io.h"

#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfMatrixAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTestFile.h>

namespace vitrine {
namespace {

constexpr int kMaxChannels = 256;  // a composite has about 25

void check_header(const std::filesystem::path& path, const Imf::Header& header) {
    const Imath::Box2i window = header.dataWindow();
    const std::int64_t width = static_cast<std::int64_t>(window.max.x) - window.min.x + 1;
    const std::int64_t height = static_cast<std::int64_t>(window.max.y) - window.min.y + 1;
    if (width <= 0 || height <= 0 || width * height > kMaxPixels) {
        throw InputError({path.string(), fmt::format("at most {} megapixels", kMaxPixels >> 20),
                          fmt::format("a data window of {} x {}", width, height), ""});
    }
    int count = 0;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) ++count;
    if (count == 0 || count > kMaxChannels) {
        throw InputError({path.string(), fmt::format("1 to {} channels", kMaxChannels),
                          fmt::format("{}", count), ""});
    }
}

}  // namespace

ExrImage read_exr(const std::filesystem::path& path) {
    bool tiled = false, deep = false, multi_part = false;
    if (!Imf::isOpenExrFile(path.c_str(), tiled, deep, multi_part)) {
        throw InputError({path.string(), "an OpenEXR file", "something else or no file", ""});
    }
    if (deep || multi_part) {
        throw InputError({path.string(), "a flat single-part EXR",
                          deep ? "deep data" : "several parts", "Export it as a flat image."});
    }
    try {
        Imf::InputFile file(path.c_str());
        check_header(path, file.header());
        const Imath::Box2i window = file.header().dataWindow();
        ExrImage image;
        image.width = window.max.x - window.min.x + 1;
        image.height = window.max.y - window.min.y + 1;
        Imf::FrameBuffer buffer;
        const Imf::ChannelList& list = file.header().channels();
        for (auto it = list.begin(); it != list.end(); ++it) {
            if (it.channel().xSampling != 1 || it.channel().ySampling != 1) {
                throw InputError({path.string(), "full-resolution channels",
                                  fmt::format("subsampled channel {}", it.name()), ""});
            }
            ImageF& plane =
                image.channels.emplace(it.name(), ImageF(image.width, image.height)).first->second;
            buffer.insert(it.name(), Imf::Slice::Make(Imf::FLOAT, plane.data(), window));
        }
        file.setFrameBuffer(buffer);
        file.readPixels(window.min.y, window.max.y);
        for (auto it = file.header().begin(); it != file.header().end(); ++it) {
            if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute())) {
                image.attributes[it.name()] = text->value();
            } else if (const auto* matrix =
                           dynamic_cast<const Imf::M44fAttribute*>(&it.attribute())) {
                Mat4& m = image.matrices[it.name()];
                for (int i = 0; i < 16; ++i) m(i % 4, i / 4) = matrix->value()[i / 4][i % 4];
            }
        }
        return image;
    } catch (const InputError&) {
        throw;
    } catch (const std::exception& error) {
        throw InputError({path.string(), "a whole EXR", error.what(), ""});
    }
}

ImageRgb read_exr_rgb(const std::filesystem::path& path) {
    const ExrImage exr = read_exr(path);
    const auto plane = [&](const char* name) -> const ImageF& {
        auto found = exr.channels.find(name);
        if (found == exr.channels.end()) found = exr.channels.find("Y");
        if (found == exr.channels.end()) {
            throw InputError({path.string(), "channels R, G, B or Y", "none of them", ""});
        }
        return found->second;
    };
    const ImageF &r = plane("R"), &g = plane("G"), &b = plane("B");
    ImageRgb image(exr.width, exr.height);
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = Rgb(r[i], g[i], b[i]);
    return image;
}

void write_exr(const std::filesystem::path& path, const ExrImage& image,
               const ExrWriteOptions& options) {
    write_file_atomically(path, [&](const std::filesystem::path& temporary) {
        try {
            Imf::Header header(image.width, image.height);
            header.compression() = Imf::ZIP_COMPRESSION;
            Imf::addChromaticities(header, Imf::Chromaticities());  // Rec. 709 primaries, D65
            for (const auto& [name, value] : image.attributes) {
                header.insert(name, Imf::StringAttribute(value));
            }
            for (const auto& [name, value] : image.matrices) {
                Imath::M44f m;
                for (int i = 0; i < 16; ++i) {
                    m[i / 4][i % 4] = static_cast<float>(value(i % 4, i / 4));
                }
                header.insert(name, Imf::M44fAttribute(m));
            }
            Imf::FrameBuffer buffer;
            std::vector<std::vector<half>> halves;
            halves.reserve(image.channels.size());
            for (const auto& [name, plane] : image.channels) {
                VITRINE_CHECK_EQ(plane.width(), image.width);
                VITRINE_CHECK_EQ(plane.height(), image.height);
                const bool keep_float =
                    !options.half ||
                    std::find(options.float_channels.begin(), options.float_channels.end(), name) !=
                        options.float_channels.end();
                header.channels().insert(name, Imf::Channel(keep_float ? Imf::FLOAT : Imf::HALF));
                if (keep_float) {
                    buffer.insert(name,
                                  Imf::Slice::Make(Imf::FLOAT, plane.data(), header.dataWindow()));
                } else {
                    std::vector<half>& values = halves.emplace_back(plane.size());
                    for (std::size_t i = 0; i < plane.size(); ++i) {
                        values[i] = half(std::clamp(plane[i], -65504.0f, 65504.0f));
                    }
                    buffer.insert(name,
                                  Imf::Slice::Make(Imf::HALF, values.data(), header.dataWindow()));
                }
            }
            Imf::OutputFile file(temporary.c_str(), header);
            file.setFrameBuffer(buffer);
            file.writePixels(image.height);
        } catch (const std::exception& error) {
            throw MachineError("cannot write " + path.string() + ": " + error.what());
        }
    });
}

void add_rgb(ExrImage& exr, const std::string& layer, const ImageRgb& image) {
    if (exr.channels.empty()) {
        exr.width = image.width();
        exr.height = image.height();
    }
    const char* names[3] = {"R", "G", "B"};
    for (int c = 0; c < 3; ++c) {
        ImageF plane(image.width(), image.height());
        for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = image[i][c];
        exr.channels[layer.empty() ? names[c] : layer + "." + names[c]] = std::move(plane);
    }
}

void write_exr(const std::filesystem::path& path, const ImageRgb& image,
               const ExrWriteOptions& options) {
    ExrImage exr;
    add_rgb(exr, "", image);
    write_exr(path, exr, options);
}

}  // namespace vitrine
