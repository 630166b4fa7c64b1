#include "capture/colmap_model.h"

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <sstream>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

struct CameraModel {
    int id;
    const char* name;
    std::size_t parameters;
};
constexpr std::array<CameraModel, 6> kModels = {{{0, "SIMPLE_PINHOLE", 3},
                                                 {1, "PINHOLE", 4},
                                                 {2, "SIMPLE_RADIAL", 4},
                                                 {3, "RADIAL", 5},
                                                 {4, "OPENCV", 8},
                                                 {6, "FULL_OPENCV", 12}}};
constexpr std::uint64_t kMaxSide_px = 65536;

CameraIntrinsic make_intrinsic(const CameraModel& model, std::uint64_t width, std::uint64_t height,
                               const std::vector<double>& p, const std::string& where) {
    if (width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px) {
        throw InputError({where, fmt::format("a size of 1 to {} pixels", kMaxSide_px),
                          fmt::format("{} x {}", width, height), ""});
    }
    const bool has_one_focal = model.id == 0 || model.id == 2 || model.id == 3;
    CameraIntrinsic intrinsic;
    Camera& c = intrinsic.camera;
    c.width = static_cast<int>(width);
    c.height = static_cast<int>(height);
    c.fx = p[0];
    c.fy = has_one_focal ? p[0] : p[1];
    const std::size_t centre = has_one_focal ? 1 : 2;
    c.cx = p[centre] - 0.5;  // there, pixel centres lie at +0.5
    c.cy = p[centre + 1] - 0.5;
    LensDistortion& d = intrinsic.distortion;
    if (model.id == 2) d.k1 = p[3];
    if (model.id == 3) d.k1 = p[3], d.k2 = p[4];
    if (model.id == 4 || model.id == 6) d.k1 = p[4], d.k2 = p[5], d.p1 = p[6], d.p2 = p[7];
    if (model.id == 6) d.k3 = p[8];
    for (const double value : p) {
        if (!std::isfinite(value)) throw InputError({where, "finite numbers", "none", ""});
    }
    if (!(c.fx > 0 && c.fy > 0)) {
        throw InputError({where, "focal lengths > 0", fmt::format("{:g}, {:g}", c.fx, c.fy), ""});
    }
    if (model.id == 6 && (p[9] != 0 || p[10] != 0 || p[11] != 0)) {
        throw InputError({where, "k4 = k5 = k6 = 0", "a rational lens model",
                          "Run colmap image_undistorter first."});
    }
    return intrinsic;
}

[[noreturn]] void unknown_model(const std::string& where, const std::string& found) {
    std::vector<std::string> names;
    for (const CameraModel& model : kModels) names.emplace_back(model.name);
    throw InputError({where, "a camera model out of " + join(names, ", "), found,
                      "Run colmap image_undistorter first."});
}

Rigid3 make_pose(const std::array<double, 7>& v, const std::string& where) {
    const Eigen::Quaterniond q(v[0], v[1], v[2], v[3]);
    const Vec3 t(v[4], v[5], v[6]);
    if (!t.allFinite() || !(std::abs(q.norm() - 1.0) < 0.01)) {
        throw InputError({where, "a unit quaternion qw qx qy qz and a translation",
                          fmt::format("a quaternion of length {:g}", q.norm()), ""});
    }
    return Rigid3::from_quaternion(q, t);
}

/// Little-endian values of a file in memory; every read is checked against its end.
class Bytes {
  public:
    explicit Bytes(const fs::path& path) : where_(path.string()), data_(read_text_file(path)) {}

    template <typename T>
    T next() {
        T value;
        std::memcpy(&value, take(sizeof(T)), sizeof(T));
        return value;
    }
    /// A count of records that take at least `bytes_each`.
    std::uint64_t count(std::size_t bytes_each) {
        const auto value = next<std::uint64_t>();
        if (value > (data_.size() - at_) / bytes_each) {
            throw InputError({where_, "as many records as the file says",
                              fmt::format("{} records in {} bytes", value, data_.size()),
                              "Is the file cut off?"});
        }
        return value;
    }
    std::string name() {
        const std::size_t end = data_.find('\0', at_);
        if (end == std::string::npos) take(data_.size());
        std::string text = data_.substr(at_, end - at_);
        at_ = end + 1;
        return text;
    }
    void skip(std::size_t bytes) { take(bytes); }
    const std::string& where() const { return where_; }

  private:
    const char* take(std::size_t bytes) {
        if (bytes > data_.size() - at_) {
            throw InputError(
                {where_, "a whole file", "the end of the file", "Is the file cut off?"});
        }
        const char* place = data_.data() + at_;
        at_ += bytes;
        return place;
    }
    std::string where_;
    std::string data_;
    std::size_t at_ = 0;
};

void read_binary_cameras(const fs::path& path, ColmapModel& model) {
    Bytes in(path);
    for (std::uint64_t n = in.count(4 + 4 + 8 + 8); n > 0; --n) {
        const auto id = in.next<std::uint32_t>();
        const auto kind = in.next<std::int32_t>();
        const auto width = in.next<std::uint64_t>(), height = in.next<std::uint64_t>();
        const auto found = std::find_if(kModels.begin(), kModels.end(),
                                        [&](const CameraModel& m) { return m.id == kind; });
        if (found == kModels.end()) unknown_model(in.where(), fmt::format("model {}", kind));
        std::vector<double> parameters(found->parameters);
        for (double& p : parameters) p = in.next<double>();
        model.cameras[id] = make_intrinsic(*found, width, height, parameters,
                                           fmt::format("{}, camera {}", in.where(), id));
    }
}

void read_binary_images(const fs::path& path, ColmapModel& model) {
    Bytes in(path);
    for (std::uint64_t n = in.count(4 + 7 * 8 + 4 + 1 + 8); n > 0; --n) {
        ColmapImage image;
        const auto id = in.next<std::uint32_t>();
        std::array<double, 7> pose;
        for (double& v : pose) v = in.next<double>();
        image.cam_from_world = make_pose(pose, fmt::format("{}, image {}", in.where(), id));
        image.camera_id = in.next<std::uint32_t>();
        image.name = in.name();
        for (std::uint64_t k = in.count(24); k > 0; --k) {
            in.skip(16);
            const auto point = in.next<std::int64_t>();
            if (point >= 0) image.point_ids.push_back(static_cast<std::uint64_t>(point));
        }
        model.images.push_back(std::move(image));
    }
}

void read_binary_points(const fs::path& path, ColmapModel& model) {
    Bytes in(path);
    for (std::uint64_t n = in.count(8 + 24 + 3 + 8 + 8); n > 0; --n) {
        const auto id = in.next<std::uint64_t>();
        Vec3 point;
        for (int k = 0; k < 3; ++k) point[k] = in.next<double>();
        in.skip(3 + 8);
        in.skip(8 * static_cast<std::size_t>(in.count(8)));
        if (point.allFinite()) model.points[id] = point;
    }
}

/// Calls `row(words, where)` for each line, comments left out; empty lines count when asked for.
template <typename Row>
void for_each_line(const fs::path& path, bool keeps_empty, const Row& row) {
    std::istringstream in(read_text_file(path));
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
        if (!line.empty() && line[0] == '#') continue;
        const std::vector<std::string> words = split_whitespace(line);
        if (!words.empty() || keeps_empty) row(words, fmt::format("{}:{}", path.string(), number));
    }
}

double number(const std::vector<std::string>& words, std::size_t i, const std::string& where) {
    double value = 0;
    if (i >= words.size() || !parse_double(words[i], value) || !std::isfinite(value)) {
        throw InputError({where, "a finite number",
                          i < words.size() ? "\"" + words[i] + "\"" : "the end of the line", ""});
    }
    return value;
}

std::uint64_t index(const std::vector<std::string>& words, std::size_t i, const std::string& where,
                    double largest) {
    const double value = number(words, i, where);
    if (value < 0 || value > largest || value != std::floor(value)) {
        throw InputError({where, "a whole number", "\"" + words[i] + "\"", ""});
    }
    return static_cast<std::uint64_t>(value);
}

constexpr double kMaxId = 4294967295.0, kMaxPointId = 9e15;

void read_text_cameras(const fs::path& path, ColmapModel& model) {
    for_each_line(path, false, [&](const auto& words, const std::string& where) {
        const auto id = static_cast<std::uint32_t>(index(words, 0, where, kMaxId));
        const std::string kind = words.size() > 1 ? words[1] : "";
        const auto found = std::find_if(kModels.begin(), kModels.end(),
                                        [&](const CameraModel& m) { return kind == m.name; });
        if (found == kModels.end()) unknown_model(where, "\"" + kind + "\"");
        std::vector<double> parameters;
        for (std::size_t k = 0; k < found->parameters; ++k) {
            parameters.push_back(number(words, 4 + k, where));
        }
        model.cameras[id] = make_intrinsic(*found, index(words, 2, where, kMaxId),
                                           index(words, 3, where, kMaxId), parameters, where);
    });
}

void read_text_images(const fs::path& path, ColmapModel& model) {
    bool is_head = true;  // two lines an image: the second lists its points and may be empty
    for_each_line(path, true, [&](const auto& words, const std::string& where) {
        if (is_head) {
            if (words.empty()) return;
            ColmapImage image;
            std::array<double, 7> pose;
            for (std::size_t k = 0; k < 7; ++k) pose[k] = number(words, 1 + k, where);
            image.cam_from_world = make_pose(pose, where);
            image.camera_id = static_cast<std::uint32_t>(index(words, 8, where, kMaxId));
            if (words.size() < 10) throw InputError({where, "the picture's name", "none", ""});
            std::vector<std::string> name(words.begin() + 9, words.end());
            image.name = join(name, " ");
            model.images.push_back(std::move(image));
        } else {
            if (words.size() % 3 != 0) {
                throw InputError({where, "triples x y point", fmt::format("{} words", words.size()),
                                  "Is the file cut off?"});
            }
            for (std::size_t k = 2; k < words.size(); k += 3) {
                if (words[k] == "-1") continue;
                model.images.back().point_ids.push_back(index(words, k, where, kMaxPointId));
            }
        }
        is_head = !is_head;
    });
}

void read_text_points(const fs::path& path, ColmapModel& model) {
    for_each_line(path, false, [&](const auto& words, const std::string& where) {
        model.points[index(words, 0, where, kMaxPointId)] =
            Vec3(number(words, 1, where), number(words, 2, where), number(words, 3, where));
    });
}

}  // namespace

ColmapModel read_colmap_model(const fs::path& folder) {
    ColmapModel model;
    const bool is_binary = fs::exists(folder / "cameras.bin");
    const auto file = [&](const char* stem) {
        return folder / (std::string(stem) + (is_binary ? ".bin" : ".txt"));
    };
    (is_binary ? read_binary_cameras : read_text_cameras)(file("cameras"), model);
    (is_binary ? read_binary_images : read_text_images)(file("images"), model);
    model.files = {file("cameras"), file("images")};
    if (fs::exists(file("points3D"))) {
        (is_binary ? read_binary_points : read_text_points)(file("points3D"), model);
        model.files.push_back(file("points3D"));
    }
    for (const ColmapImage& image : model.images) {
        if (!model.cameras.contains(image.camera_id)) {
            throw InputError({file("images").string(), "cameras that cameras.* describes",
                              fmt::format("camera {} of {}", image.camera_id, image.name), ""});
        }
    }
    std::sort(model.images.begin(), model.images.end(),
              [](const ColmapImage& a, const ColmapImage& b) { return a.name < b.name; });
    return model;
}

}  // namespace vitrine
