// pipeline/scan_files.h: scan and candidates to and from the workspace (10_scan, 20_candidates).
#pragma once

#include "reconstruct/candidates.h"

#include <filesystem>

namespace vitrine {

/// 10_scan: mesh.ply, trajectory.txt (refined, camera to world), scan.json.
void write_scan(const std::filesystem::path& folder, const Scan& scan, const Capture& capture);
/// The intrinsics come from the capture, the poses from the file.
Scan read_scan(const std::filesystem::path& folder, const Capture& capture);

/// 20_candidates: candidates.json, <object>.ply, silhouettes/<frame>_<object>.png.
void write_candidates(const std::filesystem::path& folder, const Candidates& candidates,
                      const Capture& capture);
Candidates read_candidates(const std::filesystem::path& folder, const Capture& capture);

/// Silhouettes that the user edited: edits/silhouettes/<frame>_<object>.png, by (object, frame).
/// @throws InputError for a name that does not fit or a picture of another size.
std::map<std::pair<std::string, std::string>, Mask> read_edited_silhouettes(
    const std::filesystem::path& folder, const Capture& capture);

/// Boxes that the user gives, edits/boxes.json: {"schema": "vitrine.boxes/1", "boxes": [...]}, each
/// {"min_m": [3], "max_m": [3]} in the world, or {"frame": id, "box_px": [x, y, width, height]}
/// around an object in a picture: what stands on the support plane there, as deep as it is wide.
/// No file, no boxes. @throws InputError
std::vector<Box3> read_edited_boxes(const std::filesystem::path& file, const Capture& capture,
                                    const Scan& scan);

}  // namespace vitrine
