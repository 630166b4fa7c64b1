// benchmarks/quality/lamp_glints.h: the lamps as glass shows them, without chance.
#pragma once

#include "image/image.h"
#include "render/render_scene.h"

namespace vitrine {

/// Mean radiance of the lamps over each pixel inside `where`, by way of glass alone: rays through
/// an even grid of `side` by `side` places, all branches of all interfaces followed until they
/// carry less than 1e-4.
ImageRgb lamps_in_glass(const RenderScene& scene, const Camera& camera, const Mask& where,
                        int side = 24);

/// How far a picture made of paths must be expected off where `lamps` adds to `base`: each path
/// either meets a lamp, which then brings `quantum` (radiance, green), or does not. Root of the
/// summed squares over `where`, clipped at `top` and blurred as insertions are; mean of many draws.
double glint_noise(const ImageRgb& base, const ImageRgb& lamps, const Mask& where, double quantum,
                   float top, double blur_px);

}  // namespace vitrine
