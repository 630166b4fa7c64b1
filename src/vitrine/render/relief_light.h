// render/relief_light.h: the light that reaches points of a relief, with the object's own shadows.
#pragma once

#include "render/translucent_samples.h"

#include <algorithm>
#include <cmath>
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

/// A ball as a point of the surface sees it.
struct BallAhead {
    std::size_t ball;
    Vec3f to_centre;
    float excess;  ///< squared radius less the squared distance of the centre

    BallAhead(std::size_t index, const Ball& of, const Vec3f& point)
        : ball(index),
          to_centre(of.centre_px - point),
          excess(of.radius_px * of.radius_px - to_centre.squaredNorm()) {}

    /// Whether a ray meets it, whose direction has this component `along` to_centre. A ball behind
    /// the point is not met.
    bool is_met(float along) const { return along > 0 && excess + along * along > 0; }
    /// To where the ray enters it; 0 from within.
    float distance(float along) const {
        return std::max(0.0f, along - std::sqrt(excess + along * along));
    }
};

/// How much of even light from everywhere, and from below, a point receives: cosine weighted, 1 and
/// facing_down(n) where nothing of the object hides it.
struct SkyShares {
    std::vector<float> ambient, below;
};
/// Irradiance of point i by the sky and from below.
inline Rgb sky_light(const ViewLights& lights, const SkyShares& sky, std::size_t i) {
    return lights.ambient.cast<float>() * sky.ambient[i] +
           lights.from_below.cast<float>() * sky.below[i];
}
SkyShares sky_shares(const Occluder& occluder, const SurfacePoints& points,
                     int direction_count = 40);

/// Irradiance by the lamps alone.
std::vector<Rgb> lamp_light(const Occluder& occluder, const SurfacePoints& points,
                            const ViewLights& lights, double eta, bool use_shadows);

/// Irradiance that enters at the points, from the other balls of a cluster too (ball_bounce.h).
/// `use_shadows` false: as if nothing were in the way, and nothing beside.
std::vector<Rgb> entering_light(const Relief& relief, const SurfacePoints& points,
                                const ViewLights& lights, double eta, bool use_shadows);

/// Directions spread evenly over the sphere (Fibonacci lattice) with z > z_min.
std::vector<Vec3> fibonacci_directions(int count, double z_min);

}  // namespace vitrine
