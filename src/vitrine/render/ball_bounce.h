// render/ball_bounce.h: light that the balls of a cluster throw on each other.
#pragma once

#include "render/relief_light.h"

#include <Eigen/SparseCore>

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
    /// What patches see of the sky.
    const SkyShares& patch_sky() const { return sky_; }

    /// What leaves the patches, all bounces; patches x L.
    /// @param direct irradiance of the patches under each of L lights
    /// @param albedo of the balls, below 1
    Eigen::MatrixXf exitance(const Eigen::MatrixXf& direct, double albedo) const;

    /// What points see: of each patch, irradiance per exitance (points x patches, few each), and
    /// the sky.
    struct View {
        Eigen::SparseMatrix<float, Eigen::RowMajor> patches;
        SkyShares sky;
    };
    View view_from(const SurfacePoints& points) const;

  private:
    static constexpr int kPatchesPerBall = 24;

    const Ball& ball_at(std::size_t k) const;
    std::size_t patch_at(std::size_t ball, const Vec3f& point) const;
    template <typename OnPatch, typename OnSky>
    void look_around(const SurfacePoints& points, std::size_t i, const OnPatch& on_patch,
                     const OnSky& on_sky) const;

    const Relief& cluster_;
    std::vector<Vec3f> position_, normal_;
    std::vector<std::int16_t> ball_;  ///< -1: unseen
    std::vector<Vec3f> ray_;
    Eigen::Matrix<float, kPatchesPerBall, 3> patch_direction_;
    Eigen::MatrixXf spread_;  ///< of one ball, patches x patches: share of what enters that leaves
    Eigen::SparseMatrix<float, Eigen::RowMajor> between_;  ///< patches x patches, as in View
    SkyShares sky_;
};

/// What reaches the balls of a cluster from all sides and changes slowly over them: from
/// everywhere, from below and, where Relief::ball_albedo says so, from other balls.
class SoftBallLight {
  public:
    SoftBallLight(const Relief& cluster, const ViewLights& lights, double eta);
    /// Irradiance. O(points rays balls).
    std::vector<Rgb> at(const SurfacePoints& points) const;

  private:
    BallBounce bounce_;
    const ViewLights& lights_;
    Eigen::MatrixXf exitance_;  ///< patches x 3
};

}  // namespace vitrine
