// render/relief_light.h: the light that reaches points of a relief, with the object's own shadows.
#pragma once

#include "render/translucent_samples.h"

#include <span>

namespace vitrine {

/// Points on the closed surface of a relief; viewer frame, pixels.
struct SurfacePoints {
    std::span<const Vec3f> position, normal;
    std::span<const std::int16_t> ball;  ///< of a cluster; empty for one body
};

/// The object as what stands in the light's way: the mirrored relief, marched through, or the balls
/// of a cluster, exactly. Keep one for many directions: making it costs O(pixels).
class Occluder {
  public:
    explicit Occluder(const Relief& relief);  ///< keeps a reference

    /// 1 where a point sees the light, 0 where the object itself is in the way. O(points).
    std::vector<float> visibility(const SurfacePoints& points, const Vec3& direction) const;

  private:
    const Relief& relief_;
    float top_ = 0;  ///< beyond this height there is nothing
};

/// How much of even light from everywhere, and from below, a point receives: cosine weighted, 1 and
/// facing_down(n) where nothing of the object hides it.
struct SkyShares {
    std::vector<float> ambient, below;
};
SkyShares sky_shares(const Occluder& occluder, const SurfacePoints& points,
                     int direction_count = 40);

/// Irradiance that enters at the points, from the other balls of a cluster too (ball_bounce.h).
/// `use_shadows` false: as if nothing were in the way, and nothing beside.
std::vector<Rgb> entering_light(const Relief& relief, const SurfacePoints& points,
                                const ViewLights& lights, double eta, bool use_shadows);

/// Directions spread evenly over the sphere (Fibonacci lattice) with z > z_min.
std::vector<Vec3> fibonacci_directions(int count, double z_min);

}  // namespace vitrine
