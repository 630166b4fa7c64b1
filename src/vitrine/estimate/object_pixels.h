// estimate/object_pixels.h: the pixels in which a candidate shows itself.
#pragma once

#include "estimate/observations.h"

#include <array>
#include <vector>

namespace vitrine {

/// One pixel on a candidate: the camera ray, where it meets the hull, what was seen.
struct ObjectPixel {
    int frame = 0;
    int u = 0, v = 0;
    Vec3f eye = Vec3f::Zero();
    Vec3f direction = Vec3f::Zero();  ///< unit, away from the camera
    SurfacePoint surface;
    float normal_variance = 0.0f;  ///< mean square turn of the normal within the pixel, rad^2:
                                   ///< twice that of the direction in which it turns least
    Vec3f turn_u = Vec3f::Zero(), turn_v = Vec3f::Zero();  ///< of the normal from pixel to pixel
    Rgb radiance = Rgb::Zero();
    bool is_clipped = false;            ///< this pixel or a neighbour, into which it may have bled
    std::array<bool, 3> is_at_least{};  ///< channels clipped in this very pixel
};

struct ObjectPixelOptions {
    int pixels_per_view = 260;  ///< enough for 1 % in every fit; more only costs time
    int border_px = 3;          ///< silhouettes mix object and background, hulls are off there
};

/// Pixels on a regular grid inside each view of the candidate; nearer parts hide it.
std::vector<ObjectPixel> object_pixels(const EstimationScene& scene, const FrameLookup& lookup,
                                       int object, const ObjectPixelOptions& options = {});

/// The 90th percentile of the scan's luminance: the unit in which residuals are weighed.
double bright_level(const FrameLookup& lookup);

}  // namespace vitrine
