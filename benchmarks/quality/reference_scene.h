// benchmarks/quality/reference_scene.h: the canonical caustic (a glass ball and a box on a table
// under a point light) whose converged pictures lie beside its `ground_truth.json`.
#pragma once

#include "scene/scene.h"

#include <filesystem>
#include <vector>

namespace vitrine {

struct ReferenceScene {
    Scene scene;                                  ///< cameras are called by their number
    std::vector<std::filesystem::path> pictures;  ///< per camera, linear EXR
    std::size_t table = 0, sphere = 0;            ///< indices of parts
};

/// @param folder holds `ground_truth.json`
/// @param sphere_rings rows of facets of the glass ball from pole to pole: 4 rings^2 triangles
ReferenceScene read_reference_scene(const std::filesystem::path& folder, int sphere_rings);

}  // namespace vitrine
