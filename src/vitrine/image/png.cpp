#include "base/file.h"
#include "image/image_io.h"

#include <png.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>

namespace vitrine {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& expected,
                         const std::string& found) {
    throw InputError({path.string(), expected, found, ""});
}

struct PngFailure {
    char message[160] = "";
};

void on_error(png_structp png, png_const_charp message) {
    auto* failure = static_cast<PngFailure*>(png_get_error_ptr(png));
    std::snprintf(failure->message, sizeof failure->message, "%s", message);
    std::longjmp(png_jmpbuf(png), 1);
}
void on_warning(png_structp, png_const_charp) {}

void write_rows(const std::filesystem::path& path, int width, int height, int bits, int colour_type,
                const std::vector<const std::uint8_t*>& rows) {
    write_file_atomically(path, [&](const std::filesystem::path& temporary) {
        const File file(std::fopen(temporary.c_str(), "wb"), &std::fclose);
        if (!file)
            throw MachineError("cannot write " + path.string() + ": " + std::strerror(errno));
        PngFailure failure;
        png_structp png =
            png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, on_error, on_warning);
        png_infop info = png_create_info_struct(png);
        if (setjmp(png_jmpbuf(png))) {
            png_destroy_write_struct(&png, &info);
            throw MachineError("cannot write " + path.string() + ": " + failure.message);
        }
        png_init_io(png, file.get());
        png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
                     bits, colour_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                     PNG_FILTER_TYPE_DEFAULT);
        png_write_info(png, info);
        if (bits == 16) png_set_swap(png);
        for (const std::uint8_t* row : rows) png_write_row(png, row);
        png_write_end(png, nullptr);
        png_destroy_write_struct(&png, &info);
        if (std::fflush(file.get()) != 0) {
            throw MachineError("cannot write " + path.string() + ": " + std::strerror(errno));
        }
    });
}

}  // namespace

RasterImage read_png(const std::filesystem::path& path) {
    const File file(std::fopen(path.c_str(), "rb"), &std::fclose);
    if (!file) refuse(path, "a readable PNG", std::strerror(errno));
    PngFailure failure;
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, on_error, on_warning);
    png_infop info = png_create_info_struct(png);
    RasterImage image;
    std::vector<std::uint8_t> bytes;
    std::vector<png_bytep> rows;
    if (setjmp(png_jmpbuf(png))) {
        png_destroy_read_struct(&png, &info, nullptr);
        refuse(path, "a whole PNG", failure.message);
    }
    png_init_io(png, file.get());
    png_set_user_limits(png, 1000000, 1000000);  // the pixel count below is the real limit
    png_read_info(png, info);
    const std::int64_t width = png_get_image_width(png, info),
                       height = png_get_image_height(png, info);
    if (width * height > kMaxPixels) {
        png_destroy_read_struct(&png, &info, nullptr);
        refuse(path, fmt::format("at most {} megapixels", kMaxPixels >> 20),
               fmt::format("{} x {}", width, height));
    }
    const int colour_type = png_get_color_type(png, info);
    if (colour_type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
    if (colour_type == PNG_COLOR_TYPE_GRAY && png_get_bit_depth(png, info) < 8) {
        png_set_expand_gray_1_2_4_to_8(png);
    }
    if (png_get_valid(png, info, PNG_INFO_tRNS)) png_set_tRNS_to_alpha(png);
    if (png_get_bit_depth(png, info) == 16) png_set_swap(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    image.width = static_cast<int>(width);
    image.height = static_cast<int>(height);
    image.channels = png_get_channels(png, info);
    image.bits = png_get_bit_depth(png, info);
    const std::size_t stride = png_get_rowbytes(png, info);
    bytes.resize(stride * static_cast<std::size_t>(height));
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
        rows.push_back(bytes.data() + y * stride);
    }
    png_read_image(png, rows.data());
    png_read_end(png, nullptr);
    png_destroy_read_struct(&png, &info, nullptr);
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                              static_cast<std::size_t>(image.channels);
    image.codes.resize(count);
    if (image.bits == 16) {
        std::memcpy(image.codes.data(), bytes.data(), count * 2);
    } else {
        std::copy_n(bytes.data(), count, image.codes.data());
    }
    return image;
}

Image<std::uint16_t> read_png16(const std::filesystem::path& path) {
    const RasterImage raster = read_png(path);
    if (raster.channels != 1 || raster.bits != 16) {
        refuse(path, "a 16-bit single-channel PNG",
               fmt::format("{} channels of {} bits", raster.channels, raster.bits));
    }
    Image<std::uint16_t> image(raster.width, raster.height);
    std::copy(raster.codes.begin(), raster.codes.end(), image.begin());
    return image;
}

void write_png(const std::filesystem::path& path, const ImageRgb8& image) {
    std::vector<const std::uint8_t*> rows;
    for (int y = 0; y < image.height(); ++y) rows.push_back(image(0, y).data());
    static_assert(sizeof(Rgb8) == 3);
    write_rows(path, image.width(), image.height(), 8, PNG_COLOR_TYPE_RGB, rows);
}

void write_png(const std::filesystem::path& path, const Mask& mask) {
    std::vector<const std::uint8_t*> rows;
    for (int y = 0; y < mask.height(); ++y) rows.push_back(&mask(0, y));
    write_rows(path, mask.width(), mask.height(), 8, PNG_COLOR_TYPE_GRAY, rows);
}

void write_png16(const std::filesystem::path& path, const Image<std::uint16_t>& image) {
    std::vector<const std::uint8_t*> rows;
    for (int y = 0; y < image.height(); ++y) {
        rows.push_back(reinterpret_cast<const std::uint8_t*>(&image(0, y)));
    }
    write_rows(path, image.width(), image.height(), 16, PNG_COLOR_TYPE_GRAY, rows);
}

}  // namespace vitrine
