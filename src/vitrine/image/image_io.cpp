#include "image/image_io.h"

#include "image/colour.h"

#include <cstring>
#include <fstream>

namespace vitrine {
namespace {

bool is_exr(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    const unsigned char magic[4] = {0x76, 0x2f, 0x31, 0x01};
    unsigned char head[4] = {};
    in.read(reinterpret_cast<char*>(head), 4);
    return in && std::memcmp(head, magic, 4) == 0;
}

}  // namespace

RasterImage read_raster(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw InputError({path.string(), "a readable picture", "no such file", ""});
    unsigned char head[8] = {};
    in.read(reinterpret_cast<char*>(head), 8);
    if (std::memcmp(head, "\x89PNG", 4) == 0) return read_png(path);
    if (head[0] == 0xff && head[1] == 0xd8) return read_jpeg(path);
    throw InputError({path.string(), "a PNG, JPEG or EXR picture", "another format", ""});
}

ImageRgb read_encoded_rgb(const std::filesystem::path& path) {
    const RasterImage raster = read_raster(path);
    const float scale = 1.0f / static_cast<float>((1 << raster.bits) - 1);
    const bool is_grey = raster.channels < 3;
    ImageRgb image(raster.width, raster.height);
    for (std::size_t i = 0; i < image.size(); ++i) {
        const std::uint16_t* code = &raster.codes[i * static_cast<std::size_t>(raster.channels)];
        for (int c = 0; c < 3; ++c) image[i][c] = static_cast<float>(code[is_grey ? 0 : c]) * scale;
    }
    return image;
}

ImageRgb read_linear_rgb(const std::filesystem::path& path) {
    if (is_exr(path)) return read_exr_rgb(path);
    ImageRgb image = read_encoded_rgb(path);
    for (Rgb& pixel : image) {
        for (int c = 0; c < 3; ++c) pixel[c] = srgb_to_linear(pixel[c]);
    }
    return image;
}

Mask read_mask(const std::filesystem::path& path) {
    const ImageRgb image = read_encoded_rgb(path);
    Mask mask(image.width(), image.height());
    for (std::size_t i = 0; i < mask.size(); ++i)
        mask[i] = image[i].mean() > 127.5f / 255 ? 255 : 0;
    return mask;
}

}  // namespace vitrine
