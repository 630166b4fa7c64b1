// compose/composite.h: a photo and a rendered difference, put together and written.
#pragma once

#include "render/differential.h"

#include <filesystem>

namespace vitrine {

/// Scales what a shadow takes away by plate / without, since it takes a share of the light that is
/// really there: noise and texture of the photo fade in shadow as they do in the world, and a model
/// that is too bright does not darken too much. Where plate + delta would still be negative, the
/// shadow layer makes up for it.
DifferentialImage fitted_to_plate(const ImageRgb& plate, DifferentialImage difference);

/// (1 - coverage) * (plate + delta) + object, linear, of the fitted difference.
/// @param plate what the camera captured, linear, the size of the difference
ImageRgb composite(const ImageRgb& plate, const DifferentialImage& difference);

struct CompositeWriteOptions {
    std::uint64_t seed = 0;  ///< goes into the attributes
};

/// Composes and writes. Layers of one part: R G B A (the finished picture), object.RGBA, delta.RGB,
/// shadow, caustics, reflection, refraction, diffuse .RGB, Z, normal.XYZ, albedo.RGB; half except
/// Z.
/// @throws MachineError
void write_composite_exr(const std::filesystem::path& path, const ImageRgb& plate,
                         const DifferentialImage& difference, const Camera& camera,
                         const CompositeWriteOptions& options = {});
/// @param linear_scale radiance shown as full white; the capture's own gives a picture to match
void write_composite_png(const std::filesystem::path& path, const ImageRgb& picture,
                         double linear_scale);

}  // namespace vitrine
