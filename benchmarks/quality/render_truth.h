// benchmarks/quality/render_truth.h: the true scene of a synthetic capture (`truth/scene.json`):
// meshes, materials, lights and cameras as they were rendered by another program.
#pragma once

#include "scene/insertion.h"

#include <filesystem>

namespace vitrine {

struct TruthScene {
    Scene scene;                ///< cameras have the frame's id
    double linear_scale = 1.0;  ///< radiance at which the camera saturates
    double direct_level = 0;    ///< green irradiance at the reference point, all lights
};

/// Edges sharper than this stay sharp. The truth was rendered with flat facets.
constexpr double kCreaseDeg = 0.0;

/// @param capture folder that holds `truth/`
TruthScene read_truth(const std::filesystem::path& capture, double crease_deg = kCreaseDeg);

/// A virtual object of the truth (`insert.json` beside its OBJ), in the world.
Part read_truth_insert(const std::filesystem::path& folder, double crease_deg = kCreaseDeg);

}  // namespace vitrine
