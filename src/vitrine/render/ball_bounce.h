// render/ball_bounce.h: light that the balls of a cluster throw on each other.
#pragma once

#include "render/relief_light.h"

#include <Eigen/Core>

#include <functional>

namespace vitrine {

/// Radiosity between patches of the balls (Goral et al. 1984), those unseen included. Scattering
/// spreads what enters at one patch over its ball before it leaves: by exp(-r / g) over the
/// distance r, g half a radius, about as berries and tomatoes do.
class BallBounce {
  public:
    /// O(patches rays balls), a few milliseconds. Keeps a reference.
    explicit BallBounce(const Relief& cluster);

    /// Where the irradiance by the lights alone is asked for.
    SurfacePoints patches() const { return {position_, normal_, ball_}; }

    /// What leaves the patches, all bounces; patches x L.
    /// @param direct irradiance of the patches under each of L lights
    /// @param albedo of the balls, below 1
    Eigen::MatrixXf exitance(const Eigen::MatrixXf& direct, double albedo) const;

    /// What points see: of each patch, irradiance per exitance (points x patches), and the sky.
    struct View {
        Eigen::MatrixXf patches;
        SkyShares sky;
    };
    View view_from(const SurfacePoints& points) const;

    /// Irradiance at points by what leaves the patches, patches x 3.
    std::vector<Rgb> irradiance(const SurfacePoints& points, const Eigen::MatrixXf& exitance) const;

  private:
    const Ball& ball_at(std::size_t k) const;
    /// The ball that a ray meets first; the number of balls if none.
    std::size_t first_hit(const Vec3f& point, const Vec3f& direction, std::int16_t own,
                          float& distance) const;
    std::size_t patch_at(std::size_t ball, const Vec3f& point) const;
    template <typename OnPatch, typename OnSky>
    void look_around(const SurfacePoints& points, std::size_t i, const OnPatch& on_patch,
                     const OnSky& on_sky) const;

    const Relief& cluster_;
    std::vector<Vec3f> position_, normal_;
    std::vector<std::int16_t> ball_;  ///< -1: unseen
    std::vector<Vec3f> patch_direction_, ray_;
    Eigen::MatrixXf spread_;   ///< of one ball, patches x patches: share of what enters that leaves
    Eigen::MatrixXf between_;  ///< patches x patches: irradiance per exitance
};

/// Irradiance at the points by lights and, where Relief::ball_albedo says so, by other balls.
/// @param direct the lights' alone, at any points
std::vector<Rgb> with_bounces(const Relief& relief, const SurfacePoints& points,
                              const std::function<std::vector<Rgb>(const SurfacePoints&)>& direct);

}  // namespace vitrine
