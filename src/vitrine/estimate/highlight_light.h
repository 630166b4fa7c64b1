// estimate/highlight_light.h: where the lamps are, from where they mirror.
#pragma once

#include "estimate/highlights.h"
#include "scene/relief.h"

namespace vitrine {

/// A lamp that shows in one or more highlights.
struct HighlightLight {
    Vec3 direction = Vec3(0, 0, 1);  ///< unit, toward the lamp, viewer frame
    Rgbd intensity = Rgbd::Ones();   ///< share of all excess, times the lamp's colour
    int votes = 1;                   ///< highlights that agree
};

/// Each blob votes w = 2 (n . v) n - v with the normal of the smooth base (bumps would scatter the
/// votes), averaged over the blob with the luminance excess. Votes within `agree_deg` of each other
/// are one lamp, at their weighted mean: on a bumpy object one lamp mirrors many times. Heaviest
/// first.
std::vector<HighlightLight> highlight_lights(const Highlights& highlights, const Relief& relief,
                                             double agree_deg = 12.0);

}  // namespace vitrine
