// capture/trajectory.h: TUM's text files: stamps with file names, stamps with poses.
#pragma once

#include "math/rigid3.h"

#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

struct StampedFile {
    double timestamp_s;
    std::string file;
};

struct StampedPose {
    double timestamp_s;
    Rigid3 world_from_camera;
};

/// Lines "stamp file"; # starts a comment. Sorted by stamp. @throws InputError with line number.
std::vector<StampedFile> read_file_list(const std::filesystem::path& path);

/// Lines "t tx ty tz qx qy qz qw", camera to world. Sorted. @throws InputError with line number
/// when a value is not finite or a quaternion is not of unit length to 1 %.
std::vector<StampedPose> read_trajectory(const std::filesystem::path& path);
void write_trajectory(const std::filesystem::path& path, const std::vector<StampedPose>& poses);

/// For each of `stamps` the index of the nearest of `others` within `tolerance_s`, or -1; each is
/// used once, nearest first (the greedy rule of TUM's associate.py).
std::vector<int> associate(const std::vector<double>& stamps, const std::vector<double>& others,
                           double tolerance_s);

}  // namespace vitrine
