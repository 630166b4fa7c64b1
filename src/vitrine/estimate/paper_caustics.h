// estimate/paper_caustics.h: the refractive index from caustics under trial lights, as the paper
// fits it (section 5.4, Eq. 13): everything on a grid.
#pragma once

#include "estimate/object_context.h"

#include <vector>

namespace vitrine {

/// Places of the scan around a candidate and what is seen there.
struct CausticReceivers {
    std::vector<SurfacePoint> points;
    std::vector<float> luminance;  ///< median over the views
};

/// Pixels of all frames on the scan inside the candidate's box, stretched four times along the
/// support plane (the paper's "expanded by four times") and once across it.
CausticReceivers find_receivers(const ObjectContext& context, int object, const SupportPlane& plane,
                                int pixels_per_view = 300);

/// Radiance per irradiance of the receivers that the lights reach unhindered: one number, the
/// paper's f in the units of the pictures. 0 when none is lit.
double receiver_reflectance(const ObjectContext& context, const CausticReceivers& receivers);

struct PaperCausticOptions {
    double ior_min = 1.2, ior_max = 2.0, ior_step = 0.01;
    double photon_count = 8e6;  ///< of each light into the half space facing the scene
    std::uint32_t opaque_mask = kAllMask;
};

/// Sum of squared errors of the receivers: entry [combination][index]. Combinations are those of
/// `score_combinations`: place p of light l is `places[l][p]`.
///
/// Each unit image (light, place, index) is made once. Only photons inside the cone around the
/// object matter; as many are traced as of `photon_count` would fall into it, so that density and
/// noise are those of the full emission. No Fresnel losses, as in the paper.
std::vector<std::vector<double>> caustic_errors(const ObjectContext& context, int object,
                                                const CausticReceivers& receivers,
                                                const std::vector<std::vector<TrialLight>>& places,
                                                const std::vector<double>& intensities,
                                                double reflectance,
                                                const PaperCausticOptions& options);

/// ior_min, ior_min + step, ..., up to ior_max.
std::vector<double> ior_grid(const PaperCausticOptions& options);

/// How many of `photon_count` photons into a half space fall into the cone around the object.
int photons_in_cone(const EstimationScene& scene, int object, const Vec3& light_position_m,
                    double photon_count);

}  // namespace vitrine
