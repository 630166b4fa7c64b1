// image/image_io.h: PNG, JPEG and EXR in and out. Headers are judged before anything is allocated.
#pragma once

#include "image/image.h"

#include <filesystem>
#include <map>
#include <string>

namespace vitrine {

/// Larger pictures are refused: 256 megapixels at 12 bytes are 3 GB.
constexpr std::int64_t kMaxPixels = 256ll * 1024 * 1024;

/// What a PNG or JPEG holds: 8 or 16 bits, grey or colour, perhaps alpha. Values are code / max in
/// [0, 1], still encoded.
struct RasterImage {
    int width = 0;
    int height = 0;
    int channels = 0;  ///< 1 grey, 2 grey + alpha, 3 RGB, 4 RGBA
    int bits = 8;
    std::vector<std::uint16_t> codes;  ///< row-major, interleaved
};

/// @throws InputError for anything unreadable, truncated, too large or (JPEG) CMYK.
RasterImage read_png(const std::filesystem::path& path);
RasterImage read_jpeg(const std::filesystem::path& path);
RasterImage read_raster(const std::filesystem::path& path);  ///< by content, PNG or JPEG

/// Colour of a PNG or JPEG, encoded in [0, 1]; grey is spread, alpha dropped.
ImageRgb read_encoded_rgb(const std::filesystem::path& path);

/// Linear radiance: PNG and JPEG are decoded from sRGB, EXR is taken as it is.
ImageRgb read_linear_rgb(const std::filesystem::path& path);

/// 8-bit mask, > 127 inside; colour is averaged.
Mask read_mask(const std::filesystem::path& path);

/// 16-bit grey codes (depth).
Image<std::uint16_t> read_png16(const std::filesystem::path& path);

/// Writers replace the file atomically. @throws MachineError
void write_png(const std::filesystem::path& path, const ImageRgb8& image);
void write_png(const std::filesystem::path& path, const Mask& mask);
void write_png16(const std::filesystem::path& path, const Image<std::uint16_t>& image);

/// A single-part scan-line EXR as named planes ("R", "object.A", "Z").
struct ExrImage {
    int width = 0;
    int height = 0;
    std::map<std::string, ImageF> channels;
    std::map<std::string, std::string> attributes;  ///< string attributes
    std::map<std::string, Mat4> matrices;           ///< 4x4, for columns (files hold the transpose)
};

/// @throws InputError for deep, tiled-only-multipart, oversized or damaged files.
ExrImage read_exr(const std::filesystem::path& path);
ImageRgb read_exr_rgb(const std::filesystem::path& path);

struct ExrWriteOptions {
    bool half = true;  ///< 16-bit colour; planes in `float_channels` stay 32-bit
    std::vector<std::string> float_channels = {"Z"};
};
void write_exr(const std::filesystem::path& path, const ExrImage& image,
               const ExrWriteOptions& options = {});
void write_exr(const std::filesystem::path& path, const ImageRgb& image,
               const ExrWriteOptions& options = {});

/// Adds planes "<layer>.R" and so on (or "R", "G", "B" for an empty layer name).
void add_rgb(ExrImage& exr, const std::string& layer, const ImageRgb& image);

}  // namespace vitrine
