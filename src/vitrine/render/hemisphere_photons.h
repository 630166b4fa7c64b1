// render/hemisphere_photons.h: photon maps of trial lights and the density of the n nearest, the
// forward model of inverse photon mapping.
//
// Kept for comparison with the published method: the density leaks 18 to 40 % over shadow borders,
// which is why the default estimator takes direct light from shadow rays.
#pragma once

#include "render/estimation_irradiance.h"

#include <span>
#include <vector>

namespace vitrine {

struct HemispherePhotonOptions {
    int photon_count = 1'000'000;
    float albedo = 0.5f;  ///< of every surface: the chance to survive a bounce (Russian roulette)
    int max_bounces = 8;  ///< 0.4 % are left after that
    std::uint64_t seed = 0;
};

struct PhotonHit {
    Vec3f position = Vec3f::Zero();
    Vec3f direction = Vec3f::Zero();  ///< of travel, unit
};

/// Arrivals on the scan of photons that a point light at `position_m` sends into the half space
/// around `axis`, and of their diffuse bounces, in photon order. Each carries 2 pi / photon_count W
/// per W/sr of the light. Candidate objects are not there. Costs about 0.2 us per photon and core.
std::vector<PhotonHit> trace_hemisphere_photons(const EstimationScene& scene,
                                                const Vec3& position_m, const Vec3& axis,
                                                const HemispherePhotonOptions& options);

/// A k-d tree over photons.
class PhotonTree {
  public:
    explicit PhotonTree(std::vector<PhotonHit> photons);

    struct Gathered {
        int count = 0;           ///< found, at most the number asked for
        float distance2 = 0.0f;  ///< of the farthest of them, m2
    };
    /// The `count` photons nearest to the point that arrived on its side.
    Gathered nearest(const SurfacePoint& point, int count) const;
    std::size_t size() const { return photons_.size(); }

  private:
    std::vector<PhotonHit> photons_;  // the middle of each range splits it
    std::vector<std::uint8_t> axis_;
};

/// Irradiance per W/sr at the points: n dPhi / (pi d^2) with d the distance to the n-th photon
/// (paper Eq. 4 to 6 with f = 1).
std::vector<float> photon_irradiance(const PhotonTree& tree, std::span<const SurfacePoint> points,
                                     int photon_count, int nearest_count);

}  // namespace vitrine
