// render/translucent_body.h: a closed mesh of translucent material, ready to turn the light that
// enters its surface into the light that leaves it.
#pragma once

#include "geometry/even_samples.h"
#include "geometry/point_grid.h"
#include "optics/radial_profile.h"
#include "render/cluster_tree.h"
#include "scene/material.h"

#include <memory>
#include <span>

namespace vitrine {

struct TranslucentBodyOptions {
    double spacing_share = 0.3;  ///< of the narrowest channel's mean distance
    int min_samples = 5'000;     ///< so that shapes with narrow necks are held whatever the profile
    int max_samples = 40'000;    ///< a minute of gathering light at most
    std::uint64_t seed = 0;
};

/// The light leaving at x is, below the interface (Jensen et al. 2001, Eq. 5),
///   B(x) = integral over the surface of R_d(|x - y|) E(y) dA,
/// with E the irradiance that enters. The profile is split (render/split_kernel.h): what spreads
/// farther than two sample spacings is summed over the samples by a tree, in two steps as of Jensen
/// and Buhler 2002. What stays nearer follows the samples' own irradiance where they are as fine as
/// it is wide, and where they are not it acts as paint of albedo `near_share`, at full resolution:
/// a profile too short for the samples turns into paint and not into blotches.
///
/// Distances are straight: through the body where it is convex, across air where it is not.
class TranslucentBody {
  public:
    TranslucentBody(std::shared_ptr<const Mesh> mesh, const Translucent& material,
                    const TranslucentBodyOptions& options = {});

    const EvenSamples& samples() const { return samples_; }
    double spacing_m() const { return spacing_m_; }
    /// Albedo of the part of the profile that is left to paint.
    const Rgb& near_share() const { return near_share_; }
    /// Albedo of the whole profile, on a plane.
    const Rgb& albedo() const { return albedo_; }

    /// B at each sample without that part, W/m2. @param irradiance that entered, W/m2, per sample
    std::vector<Rgb> exitance(std::span<const Rgb> irradiance) const;

    /// A value per sample, at a point of the surface: linear fit to the samples around it that face
    /// like `normal` (moving least squares), kept within their range.
    Rgb interpolate(std::span<const Rgb> values, const Vec3f& position, const Vec3f& normal) const;

    /// The sample nearest to a point of the surface, -1 when none faces like `normal`.
    int nearest_sample(const Vec3f& position, const Vec3f& normal) const;

  private:
    EvenSamples samples_;
    double spacing_m_ = 0;
    Rgb near_share_ = Rgb::Zero();
    Rgb sample_share_ = Rgb::Zero();  // of the near part, held by the samples
    Rgb albedo_ = Rgb::Zero();
    PointGrid grid_;
    ClusterTree tree_;
    std::unique_ptr<const KernelTable> far_kernel_;
};

}  // namespace vitrine
