// capture/photo.h: one photograph of one object, with the mask that cuts it out.
#pragma once

#include "image/image.h"
#include "image/pixel_box.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vitrine {

struct Photo {
    std::string name;  ///< file name for messages
    ImageRgb linear;   ///< linear Rec. 709; 1 is the white of the picture (EXR: as in the file)
    Mask mask;         ///< 255 on the object
    double saturation_level = 1.0;      ///< linear value at which a channel clips (1e30: never)
    std::vector<std::string> warnings;  ///< one plain sentence each
};

struct PhotoOptions {
    std::filesystem::path mask;  ///< 8-bit picture, > 127 inside; wins over the box
    std::optional<PixelBox>
        box;  ///< with the object well inside; segmented with GrabCut when there is no mask
    bool is_linear = false;         ///< PNG and JPEG hold linear light instead of sRGB
    double min_inradius_px = 30.0;  ///< smaller objects tell nothing about scattering
};

/// Reads PNG, JPEG (sRGB unless told) or EXR (linear). Without a mask and box the alpha channel of
/// a PNG is the mask.
/// @throws InputError when the file or mask cannot be used: none given, empty, full, of another
/// size, or thinner than `min_inradius_px`.
Photo read_photo(const std::filesystem::path& path, const PhotoOptions& options = {});

/// Segments what stands in the box by GrabCut (Rother, Kolmogorov, Blake 2004; 6 rounds), keeps
/// the largest piece, fills its holes and smooths the contour. Deterministic. About 1 s per
/// megapixel of box; large pictures are segmented at 0.3 megapixel.
/// @throws InputError when nothing is found.
Mask segment_box(const ImageRgb& linear, const PixelBox& box, const std::string& name);

/// Keeps the largest 8-connected piece of the mask and fills what it encloses.
Mask largest_piece_filled(const Mask& mask);

/// Radius of the largest disc inside the mask; the beyond of the picture counts as outside.
double inradius_px(const Mask& mask);

}  // namespace vitrine
