#include "reconstruct/real_captures.h"

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"
#include "capture/trajectory.h"
#include "geometry/camera.h"
#include "image/image_io.h"

#include <cmath>
#include <cstdlib>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

/// Writes a TUM folder frame by frame.
class TumWriter {
  public:
    TumWriter(const fs::path& folder, const Camera& camera, double depth_scale)
        : folder_(folder), camera_(camera), depth_scale_(depth_scale) {}

    void add(const fs::path& colour, const Image<std::uint16_t>& depth, const Rigid3& pose) {
        const std::string name = fmt::format("{:06d}", poses_.size());
        const std::string picture = name + colour.extension().string();
        fs::create_directories(folder_ / "rgb");
        fs::copy_file(colour, folder_ / "rgb" / picture, fs::copy_options::overwrite_existing);
        write_png16(folder_ / "depth" / (name + ".png"), depth);
        const double stamp = 0.1 * static_cast<double>(poses_.size());
        rgb_ += fmt::format("{:.4f} rgb/{}\n", stamp, picture);
        list_ += fmt::format("{:.4f} depth/{}.png\n", stamp, name);
        poses_.push_back({stamp, pose});
    }

    void finish() const {
        write_text_file(folder_ / "rgb.txt", rgb_);
        write_text_file(folder_ / "depth.txt", list_);
        write_trajectory(folder_ / "groundtruth.txt", poses_);
        const Camera& c = camera_;
        write_text_file(folder_ / "camera_intrinsic.json",
                        fmt::format("{{\"width\": {}, \"height\": {}, \"intrinsic_matrix\": [{}, "
                                    "0, 0, 0, {}, 0, {}, {}, 1]}}",
                                    c.width, c.height, c.fx, c.fy, c.cx, c.cy));
        write_text_file(folder_ / "capture.json",
                        fmt::format("{{\"depth_scale\": {}}}", depth_scale_));
    }

  private:
    fs::path folder_;
    Camera camera_;
    double depth_scale_;
    std::string rgb_, list_;
    std::vector<StampedPose> poses_;
};

/// All numbers of a text, in order; words that are none are left out.
std::vector<double> numbers_in(const std::string& text) {
    std::vector<double> numbers;
    for (const std::string& word : split_whitespace(text)) {
        double value = 0;
        if (parse_double(word, value)) numbers.push_back(value);
    }
    return numbers;
}

/// The `count` numbers after a heading.
std::vector<double> block(const std::string& text, const std::string& heading, std::size_t count) {
    const std::size_t at = text.find(heading);
    VITRINE_CHECK(at != std::string::npos);
    const std::size_t begin = text.find('\n', at);
    std::vector<double> numbers = numbers_in(text.substr(begin, text.find('#', begin) - begin));
    VITRINE_CHECK_LE(count, numbers.size());
    numbers.resize(count);
    return numbers;
}

Rigid3 rigid_of(const std::vector<double>& m) {
    Mat3 rotation;
    for (int k = 0; k < 9; ++k) rotation(k / 3, k % 3) = m[std::size_t(4 * (k / 3) + k % 3)];
    return Rigid3::from_quaternion(Eigen::Quaterniond(rotation).normalized(),
                                   Vec3(m[3], m[7], m[11]));
}

}  // namespace

std::optional<fs::path> real_data(const std::string& name) {
    const char* root = std::getenv("VITRINE_REAL_DATA");
    if (!root || !fs::is_directory(fs::path(root) / name)) return std::nullopt;
    return fs::path(root) / name;
}

void convert_shelf(const fs::path& from, const fs::path& to) {
    const std::string info = read_text_file(from / "cam.info.txt");
    const std::vector<double> k = block(info, "# Color camera intrinsic", 9);
    TumWriter writer(to, {"", 640, 480, k[0], k[4], k[2], k[5], {}}, 10000);
    for (int i = 0; i < 15; ++i) {
        const std::string name = fmt::format("frame-{:06d}", i);
        Image<std::uint16_t> depth = read_png16(from / (name + ".depth.png"));
        for (std::uint16_t& v : depth) v = static_cast<std::uint16_t>((v << 13) | (v >> 3));
        const std::vector<double> pose =
            block(info, "# Camera-to-world extrinsic matrix (camera pose) for " + name, 16);
        writer.add(from / (name + ".color.png"), depth, rigid_of(pose));
    }
    writer.finish();
}

void convert_kinect_glasses(const fs::path& from, const fs::path& to) {
    TumWriter writer(to, {"", 640, 480, 525, 525, 320.5, 240.5, {}}, 1000);
    writer.add(from / "image.png", read_png16(from / "depth_mm.png"), Rigid3());
    writer.finish();
}

void convert_d435(const fs::path& from, const std::string& scene, const std::string& kind,
                  const fs::path& to) {
    const ExrImage exr = read_exr(from / (scene + "-" + kind + "-depth-img.exr"));
    const ImageF& metres = exr.channels.begin()->second;
    Image<std::uint16_t> depth(exr.width, exr.height);
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const double code = 5000.0 * metres[i];
        depth[i] = code > 0 && code < 65535 ? static_cast<std::uint16_t>(std::lround(code)) : 0;
    }
    TumWriter writer(to, {"", 1280, 720, 921, 921, 642, 359, {}}, 5000);
    writer.add(from / (scene + "-" + kind + "-rgb-img.jpg"), depth, Rigid3());
    writer.finish();
}

void convert_single_view(const fs::path& from, const fs::path& to) {
    const std::vector<double> k = numbers_in(read_text_file(from / "intrinsics.txt"));
    VITRINE_CHECK_LE(9u, k.size());
    TumWriter writer(to, {"", 640, 480, k[0], k[4], k[2], k[5], {}}, 1000);
    fs::path colour = from / "rgb.png";
    if (!fs::exists(colour)) colour = from / "rgb.jpg";
    writer.add(colour, read_png16(from / "raw_depth.png"), Rigid3());
    writer.finish();
}

}  // namespace vitrine
