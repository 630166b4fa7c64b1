#include "estimate/object_context.h"

#include <cmath>

namespace vitrine {

namespace {

/// Intensity and distance are in doubt together: what reaches the scene is known better.
double stddev_of_irradiance(const LightEstimate& lights) {
    double sum = 0.0, square = 0.0;
    for (const FittedLight& fitted : lights.lights) {
        const double distance = (fitted.light.position_m - lights.reference_point_m).norm();
        const double irradiance =
            luminance(fitted.light.intensity_w_per_sr) / (distance * distance);
        sum += irradiance;
        square += std::pow(irradiance * fitted.stddev_irradiance_ratio, 2);
    }
    return sum > 0.0 ? std::sqrt(square) / sum : 0.0;
}

}  // namespace

ObjectContext::ObjectContext(const Scene& scene, std::span<const RgbdFrame> frames,
                             double saturation_level, const LightEstimate& lights)
    : world(scene),
      lookup(world, scene.cameras, frames, saturation_level),
      bright(bright_level(lookup)) {
    light.ambient = lights.ambient_radiance;
    light.stddev_irradiance_ratio = stddev_of_irradiance(lights);
    for (const FittedLight& fitted : lights.lights) light.lights.push_back(fitted.light);
}

KnownLight ObjectContext::light_on(int k) const {
    KnownLight result = light;
    result.opaque_mask = kScanMask | object_mask(k);
    return result;
}

}  // namespace vitrine
