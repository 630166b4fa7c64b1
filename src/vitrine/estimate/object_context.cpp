#include "estimate/object_context.h"

namespace vitrine {

ObjectContext::ObjectContext(const Scene& scene, std::span<const RgbdFrame> frames,
                             double saturation_level, const LightEstimate& lights)
    : world(scene),
      lookup(world, scene.cameras, frames, saturation_level),
      bright(bright_level(lookup)) {
    light.ambient = lights.ambient_radiance;
    for (const FittedLight& fitted : lights.lights) light.lights.push_back(fitted.light);
}

KnownLight ObjectContext::light_on(int k) const {
    KnownLight result = light;
    result.opaque_mask = kScanMask | object_mask(k);
    return result;
}

}  // namespace vitrine
