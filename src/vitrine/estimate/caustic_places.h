// estimate/caustic_places.h: the table where one clear object throws its shadow and its caustic,
// and what lamps and an index make of it. Internal to estimate.
#pragma once

#include "estimate/observations.h"
#include "render/estimation_columns.h"
#include "scene/light.h"

#include <memory>
#include <span>
#include <vector>

namespace vitrine {

struct CausticCueOptions {
    int photon_count = 40'000;       ///< per index; quasi-random: 15 a pixel suffice
    double gather_radius_m = 0.004;  ///< about two pixels seen from a metre
    int pixel_step = 3;
    std::size_t max_receivers = 6000;
    double block_size_m = 0.02;  ///< patches of the table that the evidence is summed over
};

/// Lamps and what else lights the table, as found so far.
struct CausticScene {
    std::vector<DiscLight> lights;
    Rgb ambient = Rgb::Zero();
    Rgb sigma_a_per_m = Rgb::Zero();
    std::uint32_t opaque_mask = kScanMask;  ///< parts that block, the object itself left out
    SupportPlane plane;
};

/// Pixels of all views that show the support plane where the object changes the light of the lamps
/// for any of some indices. Luminance throughout. Refers to the scene.
class CausticPlaces {
  public:
    CausticPlaces(const EstimationScene& scene, const FrameLookup& lookup, int object,
                  const CausticScene& light, std::span<const double> iors,
                  const CausticCueOptions& options);

    std::size_t size() const { return points_.size(); }
    const std::vector<int>& block() const { return block_; }  ///< patch of each place
    double patch_count() const;

    /// Irradiance without the caustic: what passes the object by, ambient and gathered light.
    std::vector<double> steady(const std::vector<DiscLight>& lamps) const;
    /// Irradiance of the caustic for each index: `[index][place]`.
    std::vector<std::vector<double>> caustic(const std::vector<DiscLight>& lamps,
                                             std::span<const double> iors) const;
    /// Geman and McClure loss of log(seen) - log(predicted) at every place, the albedo (one
    /// logarithm) fitted robustly; a clipped pixel counts as "at least".
    std::vector<double> losses(const std::vector<double>& steady,
                               const std::vector<double>& caustic) const;
    /// Mean loss. Costs about 1 us per photon.
    double cost(const std::vector<DiscLight>& lamps, double ior) const;

  private:
    const EstimationScene& scene_;
    int object_;
    Rgb sigma_a_per_m_;
    std::uint32_t opaque_mask_;
    CausticCueOptions options_;
    double saturation_level_, floor_ = 0.0;
    std::vector<SurfacePoint> points_;
    std::vector<double> seen_, gathered_;  // radiance; irradiance that no lamp throws
    std::vector<char> is_clipped_;
    std::vector<int> block_;
    std::shared_ptr<const ReceiverGrid> grid_;
};

}  // namespace vitrine
