// estimate/ball_heights.h: how far before one another the balls of a cluster lie, by the shadows
// and the light that they throw on each other.
#pragma once

#include "estimate/translucency_lights.h"

namespace vitrine {

struct BallHeightOptions {
    double first_step = 0.6, last_step = 0.1;  ///< of the search, in radii
    int rounds = 3;                            ///< at most, at each step
    int observation_count = 400;
    int samples_per_side = 700;
    double looks = 50;            ///< independent looks at the object that the misfit counts for
    double overlap_spread = 0.1;  ///< how far solid balls may sink into each other, in radii
    double gap_spread = 1.5;      ///< how far beyond touching they usually are, in radii
    double eta = 1.3;
    std::uint64_t seed = 1;
};

/// An outline says who is before whom, and touching how much at least; not how much more. Under
/// lamps and kernels that are known, shadows do: pattern search over the heights for the least
///   looks / 2 ln(misfit) + sum over pairs ((overlap / overlap_spread)^2 + (gap / gap_spread)^2) /
///   2,
/// intensities fitted anew at every step. Costs some 4 ms per step, 100 to 200 steps.
/// @param excluded highlights
std::vector<Ball> refine_ball_heights(const Relief& cluster, const ImageRgb& diffuse,
                                      const Mask& excluded, const ViewLightsEstimate& lights,
                                      const BallHeightOptions& options = {});

}  // namespace vitrine
