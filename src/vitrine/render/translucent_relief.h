// render/translucent_relief.h: the diffuse light leaving a translucent relief.
#pragma once

#include "optics/radial_profile.h"
#include "render/translucent_samples.h"

namespace vitrine {

struct TranslucentRenderOptions {
    int cells_per_side = 2500;    ///< mean error below 1 % of brute force (tested)
    double eta = 1.3;             ///< for the light that leaves
    bool use_curved_body = true;  ///< C(s) of optics/curved_body.h; false: flat R_d, as published
};

/// Renders one relief under changing light and material (Jensen et al. 2001, Eq. 5):
///   C(x) = F_t(n . v) / pi * sum over front and back of R_d(|x - y|) C(s) E(y) dA
/// with C(s) the gain of a closed body over a flat one (optics/curved_body.h),
/// on a coarse lattice, then brought to full resolution with the near field, which a lattice
/// cannot hold, put back from the full-resolution irradiance. The role of translucent shadow maps
/// (render/translucent_shadow_map.h): same idea, both sides, bounded error.
///
/// Construction costs O(pixels); each render O(cells^2) + O(pixels): about 0.1 s per megapixel.
/// Same bits for any thread count.
class TranslucentRelief {
  public:
    explicit TranslucentRelief(Relief relief, const TranslucentRenderOptions& options = {});

    /// Radiance leaving toward the viewer, without reflections; 0 outside the mask. `profile` in
    /// pixels of this relief.
    ImageRgb render(const ReliefIrradiance& irradiance, const RadialProfile& profile) const;

    const Relief& relief() const { return relief_; }
    const ReliefSamples& samples() const { return samples_; }

  private:
    std::vector<Rgb> gather(const ReliefIrradiance& irradiance, const RadialProfile& far,
                            const RadialProfile& whole) const;

    Relief relief_;
    TranslucentRenderOptions options_;
    ReliefSamples samples_;
};

/// The same integral with every pixel as sample and receiver: the reference for tests and
/// benchmarks. O(pixels^2): for small pictures, or for every `stride`-th receiver (others stay 0).
ImageRgb render_translucent_brute_force(const Relief& relief, const ReliefIrradiance& irradiance,
                                        const RadialProfile& profile,
                                        const TranslucentRenderOptions& options = {},
                                        int stride = 1);

}  // namespace vitrine
