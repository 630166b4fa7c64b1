// estimate/estimate_json.h: estimate.json ("vitrine.estimate/1") and the overrides file.
#pragma once

#include "estimate/scene_estimate.h"

#include <filesystem>

namespace vitrine {

/// Writes all that interfaces.md 4 names, and some more; replaces the file atomically.
void write_estimate(const std::filesystem::path& path, const SceneEstimate& estimate);

/// Reads what `write_estimate` wrote; unknown extra keys are welcome.
/// @throws InputError
SceneEstimate read_estimate(const std::filesystem::path& path);

/// {"objects": [{"id", "class", "ior", "sigma_a_per_m", "ignore"}], "lights": [...]}.
/// @throws InputError for unknown keys, classes or impossible numbers.
Overrides read_overrides(const std::filesystem::path& path);

}  // namespace vitrine
