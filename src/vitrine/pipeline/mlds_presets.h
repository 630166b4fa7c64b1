// pipeline/mlds_presets.h: the four experiments of the paper (Sec. 6.1) as scenes of our own
// making; the paper prints index ranges and kinds of light, not its meshes, sizes or camera.
#pragma once

#include "pipeline/mlds_series.h"

namespace vitrine {

/// "sphere_point" (1.400 to 1.465), "bottle_point" (1.500 to 1.565), "pane_disc" (1.300 to 1.380,
/// fine shape, area light), "cup_spot" (1.300 to 1.375).
std::vector<std::string> mlds_preset_names();

/// @throws InputError for an unknown name; lists the known ones.
SeriesSpec make_mlds_preset(const std::string& name);

/// Writes FOLDER/<name>.json and FOLDER/<name>/{scene.json, *.ply} for every preset.
void write_mlds_presets(const std::filesystem::path& folder);

}  // namespace vitrine
