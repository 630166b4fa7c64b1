// benchmarks/runtime/canonical_scene.h: a glass ball, a point light of 1 W/sr, a table, a red box:
// the scene that the speed of renderers is compared on.
#pragma once

#include "scene/scene.h"

namespace vitrine {

/// Glass sphere n = 1.5, radius 0.06 m, centre (0, 0, 0.061); table albedo 0.6 of 1.2 m; point
/// light at (0.55, -0.45, 0.8). Four cameras 640x360 around it, 90 degrees apart.
/// @param sphere_triangles at least so many
Scene canonical_scene(int sphere_triangles = 20'000);

}  // namespace vitrine
