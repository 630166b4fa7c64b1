// estimate/caustic_cue.h: the second cue for a refractive index: the light that a clear object
// throws on the table. Internal to estimate/transparent and estimate/materials.
#pragma once

#include "estimate/caustic_places.h"
#include "estimate/estimate.h"

#include <span>
#include <vector>

namespace vitrine {

/// Robust cost of every trial index over the object's shadow and caustic on the support plane: mean
/// Geman and McClure loss of log(seen) - log(predicted), one free albedo; clipped pixels are
/// compared with clipped predictions. Empty `cost` when the pictures show no such place.
struct CausticCue {
    std::vector<double> cost;  ///< [index]
    double stddev = 0.0;       ///< of the best index, over resampled patches of the table
    std::size_t receiver_count = 0;
};
/// Costs about 1 us per photon, index and core.
CausticCue caustic_cue(const EstimationScene& scene, const FrameLookup& lookup, int object,
                       const CausticScene& light, std::span<const double> iors,
                       const CausticCueOptions& options = {});

/// Index from both cues as one likelihood: the view through the object as a normal density of its
/// own value and deviation, the caustic likewise, around the minimum of its cost. Where the view
/// shows no index the caustic answers alone; where both are sure and disagree, the view is kept,
/// which hulls disturb ten times less.
Estimate<double> combined_index(const Estimate<double>& through, std::span<const double> iors,
                                const CausticCue& cue);

}  // namespace vitrine
