// estimate/transparent.h: index and absorption of a clear object from the background it bends.
//
// The view through the object needs no light and no caustic, and on visual hulls it is several
// times more exact than caustics: every pixel of the object is a ray that lands somewhere on the
// scan, and other views know what is seen there.
#pragma once

#include "estimate/estimate.h"
#include "estimate/object_pixels.h"

#include <vector>

namespace vitrine {

struct TransparentOptions {
    double ior_min = 1.20;  ///< as in the paper
    double ior_max = 2.00;
    double ior_step = 0.0;         ///< > 0: answers only on this grid (the paper's lambda)
    std::vector<double> ior_grid;  ///< answers only on these (a lambda that varies), rising
    double shell_ior = 1.5;        ///< assumed for vessels: thin walls hardly bend light
    Rgb ambient = Rgb::Zero();     ///< beyond the scan, where glass does not show it better
    bool is_ambient_known = false;
    std::optional<double> known_ior;
    std::optional<Rgb> known_sigma_a;
};

/// What one trial predicts in one pixel: transmitted * exp(-sigma_a length) + reflected, and the
/// light that was reflected inside once: left out, it is read as a clearer glass (0.5 per metre).
struct ThroughPixel {
    bool is_valid = false;
    Rgb transmitted = Rgb::Zero();
    Rgb reflected = Rgb::Zero();
    float length_m = 0.0f;
    Rgb inner = Rgb::Zero();
    float inner_length_m = 0.0f;
    /// How much of each comes from beyond the scan, per unit of the radiance there; the ambient
    /// light's is already in.
    struct Beyond {
        float transmitted = 0.0f, reflected = 0.0f, inner = 0.0f;
    } beyond;
    /// All but the main way.
    Rgb side_light(const Rgb& sigma_a) const {
        return reflected + inner * (-sigma_a * inner_length_m).exp();
    }
    Rgb radiance(const Rgb& sigma_a) const {
        return transmitted * (-sigma_a * length_m).exp() + side_light(sigma_a);
    }
};

constexpr double kMinSolidLength = 0.005;  ///< metres

struct TransparentFit {
    Estimate<double> ior;
    Estimate<Rgb> sigma_a_per_m{Rgb::Zero(), Rgb::Zero(), 0.0, Outcome::NotIdentifiable, {}};
    double cost = 1.0;         ///< mean of min(|residual| / bright level, 0.25)
    double explained = 0.0;    ///< share of pixels with a prediction
    Rgb beyond = Rgb::Zero();  ///< radiance taken for what lies beyond the scan
    bool is_shell = false;
    Estimate<double> wall_m;  ///< of a shell
};

/// Predicts all pixels for a solid of index `ior`: the mean over four rays in each.
std::vector<ThroughPixel> look_through(const EstimationScene& scene, const FrameLookup& lookup,
                                       int object, const std::vector<ObjectPixel>& pixels,
                                       double ior, const Rgb& ambient);
/// The same for a hollow vessel: the hull's surface and another `wall_m` further in.
std::vector<ThroughPixel> look_through_vessel(const EstimationScene& scene,
                                              const FrameLookup& lookup, int object,
                                              const std::vector<ObjectPixel>& pixels, double ior,
                                              double wall_m, const Rgb& ambient);

/// Per channel the sigma_a >= 0 that minimises the absolute deviations of the logarithms, weighted
/// by length: the weighted median of ln(r0 / r) / d (paper Eq. 14, exact minimiser).
/// @param min_length_m shorter ways tell nothing of absorption
/// @param count how often each pixel counts; empty: once
Rgb fit_absorption(const std::vector<ThroughPixel>& through, const std::vector<ObjectPixel>& pixels,
                   double bright, double min_length_m = kMinSolidLength,
                   const std::vector<int>& count = {});

/// Mean robust cost of a prediction with absorption; pixels without one do not count.
double through_cost(const std::vector<ThroughPixel>& through,
                    const std::vector<ObjectPixel>& pixels, const Rgb& sigma_a, double bright,
                    const std::vector<int>& count = {});
/// Over an even background every trial predicts about the same picture: whether the worst one is
/// not worse than the best by a clear factor and by more than pictures' gains err.
bool is_indifferent(double least_cost, double greatest_cost);
/// How often each pixel is drawn when whole views are drawn with replacement.
std::vector<int> resample_views(const std::vector<ObjectPixel>& pixels, int view_count,
                                std::uint64_t round);
double share_explained(const std::vector<ThroughPixel>& through);

/// Index by grid and golden section, absorption profiled out; deviations by resampling views.
/// Costs about 1 s on two cores.
TransparentFit fit_solid(const EstimationScene& scene, const FrameLookup& lookup, int object,
                         const std::vector<ObjectPixel>& pixels, double bright,
                         const TransparentOptions& options);

/// Wall thickness by a logarithmic grid of refracting shells of common glass (or the known index),
/// tint profiled out; deviations by resampling views. The index bends thin walls' light too little
/// to be found. Costs about 1 s on two cores.
TransparentFit fit_shell(const EstimationScene& scene, const FrameLookup& lookup, int object,
                         const std::vector<ObjectPixel>& pixels, double bright,
                         const TransparentOptions& options);

}  // namespace vitrine
