// estimate/object_context.h: what every fit of a candidate starts from, made once per light.
#pragma once

#include "estimate/lights.h"
#include "estimate/object_pixels.h"
#include "estimate/specular.h"

#include <span>

namespace vitrine {

/// The scene as the cameras see it and the light that falls on it. Keeps references to scene and
/// frames; neither copied nor moved, because its members point at each other.
struct ObjectContext {
    ObjectContext(const Scene& scene, std::span<const RgbdFrame> frames, double saturation_level,
                  const LightEstimate& lights);
    ObjectContext(const ObjectContext&) = delete;
    ObjectContext& operator=(const ObjectContext&) = delete;

    /// Light on candidate `k`, which may shade itself.
    KnownLight light_on(int k) const;

    EstimationScene world;
    FrameLookup lookup;
    double bright;  ///< bright_level(lookup)
    KnownLight light;
};

}  // namespace vitrine
