#include "capture/made_capture.h"

#include "base/file.h"
#include "capture/trajectory.h"
#include "image/colour.h"
#include "image/image_io.h"

#include <cmath>

namespace vitrine {
namespace fs = std::filesystem;

std::string made_frame_name(int frame) { return fmt::format("{:06d}", frame); }

MadePoint look_at_made_world(const Camera& camera, double u, double v) {
    const Vec3 o = camera.centre_in_world(), d = camera.ray_in_world(u, v);
    double nearest = -o.z() / d.z();
    // Slabs of the block.
    const Vec3 low(-0.08, -0.06, 0.0), high(0.1, 0.05, 0.09);
    double enter = 0, leave = 1e9;
    for (int k = 0; k < 3; ++k) {
        const double a = (low[k] - o[k]) / d[k], b = (high[k] - o[k]) / d[k];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
    }
    if (enter < leave && enter < nearest) nearest = enter;
    const Vec3 p = o + nearest * d;
    return {camera.depth(p),
            0.5 + 0.24 * std::sin(40 * p.x() + 9 * p.z()) * std::cos(30 * p.y() - 20 * p.z()) +
                0.12 * std::sin(170 * p.x() + 60 * p.z()) * std::cos(150 * p.y() - 70 * p.z())};
}

Camera MadeCapture::camera(int frame) const {
    const double angle = orbit_rad * frame;
    return {"",
            width,
            height,
            focal_px,
            focal_px,
            0.5 * (width - 1),
            0.5 * (height - 1),
            look_at(Vec3(0.6 * std::cos(angle), 0.6 * std::sin(angle), 0.45 + 0.07 * (frame % 3)),
                    Vec3::Zero(), Vec3(0, 0, 1))
                .inverse()};
}

namespace {

/// The pixel of the ideal pinhole that the lens shows at (u, v).
Vec2 ideal_pixel(const Camera& c, const LensDistortion& lens, double u, double v) {
    const Vec2 ideal = lens.undistort({(u - c.cx) / c.fx, (v - c.cy) / c.fy});
    return {ideal.x() * c.fx + c.cx, ideal.y() * c.fy + c.cy};
}

}  // namespace

ImageRgb8 MadeCapture::colour(int frame) const {
    const Camera c = camera(frame);
    const int reach = blur_px(frame);
    ImageRgb linear(width, height);
    for (int v = 0; v < height; ++v) {
        for (int u = 0; u < width; ++u) {
            double sum = 0;
            for (int s = -reach; s <= reach; ++s) {
                const Vec2 at = ideal_pixel(c, distortion, u + s, v);
                sum += look_at_made_world(c, at.x(), at.y()).brightness / (2 * reach + 1);
            }
            linear(u, v) = Rgb::Constant(static_cast<float>(exposure(frame) * sum));
        }
    }
    return linear_to_srgb8(linear);
}

Image<std::uint16_t> MadeCapture::depth(int frame, double depth_scale) const {
    const Camera c = camera(frame);
    Image<std::uint16_t> codes(width, height);
    for (int v = 0; v < height; ++v) {
        for (int u = 0; u < width; ++u) {
            const Vec2 at = ideal_pixel(c, distortion, u, v);
            codes(u, v) = static_cast<std::uint16_t>(
                std::lround(depth_scale * look_at_made_world(c, at.x(), at.y()).depth_m));
        }
    }
    return codes;
}

void MadeCapture::write_pictures(const fs::path& colour_folder, const fs::path& depth_folder,
                                 double depth_scale) const {
    for (int i = 0; i < frames; ++i) {
        const std::string name = made_frame_name(i) + ".png";
        write_png(colour_folder / name, colour(i));
        write_png16(depth_folder / name, depth(i, depth_scale));
    }
}

void MadeCapture::write_tum(const fs::path& folder) const {
    write_pictures(folder / "rgb", folder / "depth", 5000);
    std::string rgb, depth_list = "# comment\n";
    std::vector<StampedPose> poses;
    for (int i = 0; i < frames; ++i) {
        const std::string name = made_frame_name(i) + ".png";
        rgb += fmt::format("{:.4f} rgb/{}\n", 0.1 * i, name);
        depth_list += fmt::format("{:.4f} depth/{}\n", 0.1 * i + 0.003, name);
        poses.push_back({0.1 * i, camera(i).cam_from_world.inverse()});
    }
    write_text_file(folder / "rgb.txt", rgb);
    write_text_file(folder / "depth.txt", depth_list);
    write_trajectory(folder / "groundtruth.txt", poses);
    const Camera c = camera(0);
    const LensDistortion& d = distortion;
    write_text_file(
        folder / "camera_intrinsic.json",
        fmt::format("{{\"width\": {}, \"height\": {}, \"intrinsic_matrix\": "
                    "[{}, 0, 0, 0, {}, 0, {}, {}, 1], "
                    "\"distortion\": [{}, {}, {}, {}, {}]}}",
                    width, height, c.fx, c.fy, c.cx, c.cy, d.k1, d.k2, d.p1, d.p2, d.k3));
    write_text_file(folder / "capture.json", "{\"depth_scale\": 5000}");
}

std::string MadeCapture::gl_rows(int frame) const {
    Mat4 m = camera(frame).cam_from_world.inverse().matrix();
    m.col(1) *= -1;
    m.col(2) *= -1;
    std::string text = "[";
    for (int r = 0; r < 4; ++r) {
        text +=
            fmt::format("{}[{}, {}, {}, {}]", r ? ", " : "", m(r, 0), m(r, 1), m(r, 2), m(r, 3));
    }
    return text + "]";
}

std::string capture_error(const fs::path& folder) {
    try {
        read_capture(folder);
    } catch (const InputError& e) {
        return e.what();
    }
    return "no error";
}

}  // namespace vitrine
