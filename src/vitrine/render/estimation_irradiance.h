// render/estimation_irradiance.h: unit columns of irradiance, the linear pieces light is fitted
// with: E = sum_j I_j direct_j + ambient * openness + bounced.
//
// Direct light comes from shadow rays (a photon map leaks 18 to 40 % at shadow borders, the very
// cue); bounced light from one gather of the observed radiance, the same for every light.
#pragma once

#include "render/estimation_scene.h"

#include <span>

namespace vitrine {

/// One-sided Lambertian disc of unit on-axis intensity (1 W/sr), or, with radius 0, a point that
/// follows the same cosine.
struct TrialLight {
    Vec3 position_m = Vec3(0, 0, 1);
    Vec3 normal = Vec3(0, 0, -1);
    double radius_m = 0.0;
};

struct DirectColumn {
    std::vector<float> clear;  ///< irradiance per W/sr past all opaque parts and no see-through one
    std::vector<float>
        through;  ///< what reaches the point through a see-through part if that were air
};

/// A receiver with a footprint gets the mean over it: a pixel blurs a shadow's border as a larger
/// lamp does.
/// @param opaque_mask parts that block
/// @param see_through_mask parts that may bend light: their shadow is kept apart
/// @param sample_count disc samples where the penumbra is; 4 elsewhere
/// Costs 4 to `sample_count` shadow rays per point and mask.
DirectColumn direct_column(const EstimationScene& scene, std::span<const SurfacePoint> points,
                           const TrialLight& light, int sample_count, std::uint32_t opaque_mask,
                           std::uint32_t see_through_mask);

struct GatheredLight {
    std::vector<Rgb> bounced;     ///< irradiance from the scan's observed radiance, W/m2
    std::vector<float> openness;  ///< irradiance per unit ambient radiance: pi in the open
};

/// Cosine-weighted gather with `ray_count` quasi-random rays per point. Rays pass through the
/// parts of `see_through_mask`; an opaque candidate returns `object_radiance[candidate]`.
GatheredLight gather_light(const EstimationScene& scene, std::span<const SurfacePoint> points,
                           int ray_count, std::uint32_t see_through_mask,
                           std::span<const Rgb> object_radiance, std::uint64_t seed);

}  // namespace vitrine
