// estimate/find_lights.h: how many lights, and where, with nothing known before. Internal to
// estimate/lights.
#pragma once

#include "estimate/light_search.h"
#include "estimate/lights.h"

#include <string>

namespace vitrine {

struct FoundLights {
    LightSet set;
    double grid_cost = 0.0;               ///< of the best of the paper's grid lights alone
    Vec3 grid_direction = Vec3(0, 0, 1);  ///< toward it
    std::string rival;  ///< what else explains the scan about as well, a sentence; empty: nothing
};

/// The best lights of a dense hemisphere are refined, those that end apart again with all samples;
/// a second light is looked for beside the best of them and of the hemisphere, and kept by
/// evidence. Costs about 6 processor seconds for 3000 samples.
FoundLights find_lights(const LightFit& fit, const LightOptions& options,
                        const Progress& progress = {});

}  // namespace vitrine
