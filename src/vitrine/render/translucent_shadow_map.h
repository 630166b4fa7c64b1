// render/translucent_shadow_map.h: translucent light by the paper's own means, for comparison.
#pragma once

#include "render/translucent_relief.h"

namespace vitrine {

/// Dachsbacher and Stamminger 2003, "Translucent shadow maps", as the paper uses it: one map per
/// light with position and entering light of the visible side, mip-mapped, and 21 samples around
/// the projection of each shaded point: 3 x 3 on one level, 12 around them on the next coarser.
/// The finest level is chosen so that the pattern reaches two mean radii of the profile.
///
/// Only the front side is in the maps: what a light from behind sends through the object is lost,
/// and so is what lies beyond the pattern. Light from everywhere uses a map along the view.
/// O(pixels x lights). The lattice sum of TranslucentRelief is the accurate one.
ImageRgb render_translucent_shadow_maps(const Relief& relief, const ViewLights& lights,
                                        const RadialProfile& profile,
                                        const TranslucentRenderOptions& options = {});

}  // namespace vitrine
