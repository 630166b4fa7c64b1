// pipeline/mlds_series.h: what a difference-scaling study varies.
#pragma once

#include "scene/scene.h"

#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

/// A scene, the part whose index varies, and the indices.
struct SeriesSpec {
    std::string title;
    Scene scene;
    std::string part;
    std::vector<double> ior;
};

/// Reads "vitrine.mlds_series/1": {"title", "scene" (a file inside the folder), "part", "ior": a
/// list, or {"from", "to", "count"}}.
/// @throws InputError for a part that does not exist or is no dielectric, indices out of (1, 3].
SeriesSpec read_series_spec(const std::filesystem::path& path);
void check_series(const SeriesSpec& spec, const std::string& where);

/// The scene with the varied part at `ior`. @throws InputError as above
Scene scene_at(const SeriesSpec& spec, double ior);

}  // namespace vitrine
