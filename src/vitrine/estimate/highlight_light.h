// estimate/highlight_light.h: where the lamps are, from where they mirror.
#pragma once

#include "estimate/highlights.h"
#include "scene/relief.h"

namespace vitrine {

/// One light per highlight blob, heaviest first: w = 2 (n . v) n - v with the normal of the smooth
/// base (bumps would scatter the votes), averaged over the blob with the luminance excess.
/// Intensity: the blob's share of all excess, times the lamp's colour.
std::vector<ViewLight> highlight_lights(const Highlights& highlights, const Relief& relief);

}  // namespace vitrine
