// capture/colmap_model.h: COLMAP's sparse model, text or binary, as values.
#pragma once

#include "capture/capture_config.h"

#include <cstdint>
#include <map>

namespace vitrine {

struct ColmapImage {
    std::string name;
    std::uint32_t camera_id = 0;
    Rigid3 cam_from_world;                 ///< translation in the model's own unit
    std::vector<std::uint64_t> point_ids;  ///< of the sparse points it sees
};

struct ColmapModel {
    std::map<std::uint32_t, CameraIntrinsic> cameras;  ///< pixel centres at integers, as ours
    std::vector<ColmapImage> images;                   ///< by name
    std::map<std::uint64_t, Vec3> points;              ///< may be empty
    std::vector<std::filesystem::path> files;
};

/// Reads cameras, images and points3D (.bin if there, else .txt) of one folder. Camera models:
/// SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, and FULL_OPENCV without its last three
/// coefficients.
/// @throws InputError for other models, cut-off files, counts that the file cannot hold, numbers
/// that are not finite, quaternions of length zero, cameras that are not there.
ColmapModel read_colmap_model(const std::filesystem::path& folder);

}  // namespace vitrine
