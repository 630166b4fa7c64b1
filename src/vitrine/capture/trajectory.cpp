#include "capture/trajectory.h"

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <tuple>

namespace vitrine {
namespace {

/// Calls `row(words, place)` for each line that holds something.
template <typename Row>
void for_each_row(const std::filesystem::path& path, const Row& row) {
    std::istringstream in(read_text_file(path));
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        const std::vector<std::string> words =
            split_whitespace(std::string_view(line).substr(0, line.find('#')));
        if (!words.empty()) row(words, fmt::format("{}:{}", path.string(), number));
    }
}

double number(const std::string& word, const std::string& place) {
    double value = 0;
    if (!parse_double(word, value) || !std::isfinite(value)) {
        throw InputError({place, "a finite number", "\"" + word + "\"", ""});
    }
    return value;
}

}  // namespace

std::vector<StampedFile> read_file_list(const std::filesystem::path& path) {
    std::vector<StampedFile> list;
    for_each_row(path, [&](const std::vector<std::string>& words, const std::string& place) {
        if (words.size() != 2) {
            throw InputError(
                {place, "\"timestamp file\"", fmt::format("{} words", words.size()), ""});
        }
        list.push_back({number(words[0], place), words[1]});
    });
    std::stable_sort(list.begin(), list.end(), [](const StampedFile& a, const StampedFile& b) {
        return a.timestamp_s < b.timestamp_s;
    });
    return list;
}

std::vector<StampedPose> read_trajectory(const std::filesystem::path& path) {
    std::vector<StampedPose> poses;
    for_each_row(path, [&](const std::vector<std::string>& words, const std::string& place) {
        if (words.size() != 8) {
            throw InputError(
                {place, "\"t tx ty tz qx qy qz qw\"", fmt::format("{} words", words.size()), ""});
        }
        double v[8];
        for (std::size_t i = 0; i < 8; ++i) v[i] = number(words[i], place);
        const Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
        if (std::abs(q.norm() - 1.0) > 0.01) {
            throw InputError({place, "a unit quaternion (a rotation)",
                              fmt::format("length {:.3f}", q.norm()),
                              "The order is qx qy qz qw, camera to world."});
        }
        poses.push_back({v[0], Rigid3::from_quaternion(q, Vec3(v[1], v[2], v[3]))});
    });
    std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
        return a.timestamp_s < b.timestamp_s;
    });
    return poses;
}

void write_trajectory(const std::filesystem::path& path, const std::vector<StampedPose>& poses) {
    std::string text = "# timestamp tx ty tz qx qy qz qw (camera to world)\n";
    for (const StampedPose& pose : poses) {
        const Vec3& t = pose.world_from_camera.translation;
        const Eigen::Quaterniond q = pose.world_from_camera.quaternion();
        text += fmt::format("{:.4f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                            pose.timestamp_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    }
    write_text_file(path, text);
}

std::vector<int> associate(const std::vector<double>& stamps, const std::vector<double>& others,
                           double tolerance_s) {
    std::vector<std::tuple<double, int, int>> pairs;
    for (std::size_t i = 0; i < stamps.size(); ++i) {
        auto first = std::lower_bound(others.begin(), others.end(), stamps[i] - tolerance_s);
        for (; first != others.end() && *first <= stamps[i] + tolerance_s; ++first) {
            pairs.emplace_back(std::abs(*first - stamps[i]), static_cast<int>(i),
                               static_cast<int>(first - others.begin()));
        }
    }
    std::sort(pairs.begin(), pairs.end());
    std::vector<int> match(stamps.size(), -1);
    std::vector<bool> used(others.size(), false);
    for (const auto& [distance, i, j] : pairs) {
        if (match[static_cast<std::size_t>(i)] >= 0 || used[static_cast<std::size_t>(j)]) continue;
        match[static_cast<std::size_t>(i)] = j;
        used[static_cast<std::size_t>(j)] = true;
    }
    return match;
}

}  // namespace vitrine
