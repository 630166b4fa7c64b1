// estimate/light_outcome.h: how sure a fitted light is. Internal to estimate/lights.
#pragma once

#include "estimate/light_deviation.h"
#include "estimate/lights.h"

namespace vitrine {

/// Light `k` of a refined set with its standard deviations and outcome; intensity still one.
FittedLight with_deviations(const LightFit& fit, const LightSet& set, std::size_t k,
                            const LightDeviation& deviation, bool is_distant);

}  // namespace vitrine
