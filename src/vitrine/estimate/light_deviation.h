// estimate/light_deviation.h: how far the fitted lights can be off, all of their parameters
// together. Internal to estimate/lights.
#pragma once

#include "estimate/light_search.h"

#include <vector>

namespace vitrine {

struct LightDeviation {
    double direction_rad = 0.0;  ///< root of the mean variance of the two angles
    double log_distance = 0.0;
    double log_radius = 0.0;
    double log_intensity = 0.0;    ///< what the scale makes of all the others, itself exact
    double log_irradiance = 0.0;   ///< of the same light where the reference point faces it
    bool is_identifiable = false;  ///< the cost curves upward in both angles
};

/// Standard deviations of every light of a refined set from block sums of the loss (sandwich
/// estimator, the limit of a block bootstrap with many resamples): places, radii, shares of the
/// light and ambient light are free at once, so that what one lamp may take from another, or from
/// the ambient light, is in them. Differences over about two degrees.
/// Costs about as much as 40 evaluations of the cost for two lights.
std::vector<LightDeviation> light_deviations(const LightFit& fit, const LightSet& set);

}  // namespace vitrine
