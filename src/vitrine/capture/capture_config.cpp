#include "capture/capture_config.h"

#include "base/json_reader.h"

namespace vitrine {

Vec2 LensDistortion::distort(const Vec2& ideal) const {
    const double x = ideal.x(), y = ideal.y(), r2 = x * x + y * y;
    const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

Vec2 LensDistortion::undistort(const Vec2& bent) const {
    Vec2 ideal = bent;
    if (is_none()) return ideal;
    for (int round = 0; round < 40; ++round) {
        const Vec2 error = distort(ideal) - bent;
        ideal -= error;
        if (error.squaredNorm() < 1e-20) break;
    }
    return ideal;
}

namespace {

constexpr long long kMaxSide_px = 65536;

int side_of(const JsonObject& object, const std::string& key) {
    const long long value = object.integer(key);
    if (value < 1 || value > kMaxSide_px) {
        object.fail(key, fmt::format("a size of 1 to {} pixels", kMaxSide_px),
                    fmt::format("{}", value));
    }
    return static_cast<int>(value);
}

Rigid3 read_rigid(const JsonObject& object, const std::string& key) {
    const std::vector<double> m = object.numbers(key, 16);
    Mat3 rotation;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) rotation(r, c) = m[static_cast<std::size_t>(4 * r + c)];
    }
    if (!is_rotation(rotation, 1e-3) || m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) {
        object.fail(key, "a rotation and a translation (4 x 4, row-major, metres)",
                    "scale, shear, mirroring or another last row");
    }
    return Rigid3::from_quaternion(Eigen::Quaterniond(rotation), Vec3(m[3], m[7], m[11]));
}

}  // namespace

CaptureConfig read_capture_config(const std::filesystem::path& path) {
    CaptureConfig config;
    const JsonObject object = read_json_file(path);
    if (object.has("depth_scale")) {
        config.depth_scale = object.number("depth_scale");
        if (!(*config.depth_scale > 0)) object.fail("depth_scale", "a number > 0", "none");
    }
    if (object.has("metres_per_unit")) {
        config.metres_per_unit = object.number("metres_per_unit");
        if (!(*config.metres_per_unit > 0)) object.fail("metres_per_unit", "a number > 0", "none");
    }
    if (object.has("colour_from_depth")) {
        config.colour_from_depth = read_rigid(object, "colour_from_depth");
    }
    if (object.has("colour_space") &&
        object.choice("colour_space", {"srgb", "linear"}) == "linear") {
        config.colour_space = ColourSpace::Linear;
    }
    config.linear_scale = object.number_or("linear_scale", 1.0);
    if (!(config.linear_scale > 0)) object.fail("linear_scale", "a number > 0", "none");
    config.black_level = object.number_or("black_level", 0.0);
    if (!(config.black_level >= 0 && config.black_level < 1)) {
        object.fail("black_level", "a share of the full code in [0, 1)",
                    fmt::format("{}", config.black_level));
    }
    if (object.has("poses")) {
        config.poses = object.choice("poses", {"trajectory", "none"}) == "none"
                           ? PoseSource::None
                           : PoseSource::Trajectory;
    }
    if (object.has("exposure")) {
        const JsonObject exposure = object.object("exposure");
        for (const std::string& frame : exposure.keys()) {
            config.exposure[frame] = exposure.number(frame);
            if (!(config.exposure[frame] > 0)) exposure.fail(frame, "a number > 0", "none");
        }
    }
    if (object.has("reference_albedo")) {
        const JsonObject item = object.object("reference_albedo");
        ReferenceAlbedo reference;
        const Json& pixel = item.raw("pixel");
        if (!pixel.is_array() || pixel.size() != 3 || !pixel[0].is_string() ||
            !pixel[1].is_number() || !pixel[2].is_number()) {
            item.fail("pixel", "[\"frame\", u, v]", pixel.dump());
        }
        reference.frame = pixel[0].get<std::string>();
        reference.pixel = Vec2(pixel[1].get<double>(), pixel[2].get<double>());
        const std::vector<double> albedo = item.numbers("albedo", 3);
        for (int c = 0; c < 3; ++c) {
            const double value = albedo[static_cast<std::size_t>(c)];
            if (!(value > 0 && value <= 1)) {
                item.fail("albedo", "three numbers in (0, 1]", fmt::format("{}", value));
            }
            reference.albedo[c] = static_cast<float>(value);
        }
        item.finish();
        config.reference_albedo = reference;
    }
    object.finish();
    return config;
}

CameraIntrinsic read_camera_intrinsic(const std::filesystem::path& path) {
    const JsonObject object = read_json_file(path);
    CameraIntrinsic intrinsic;
    Camera& camera = intrinsic.camera;
    camera.width = side_of(object, "width");
    camera.height = side_of(object, "height");
    const std::vector<double> m = object.numbers("intrinsic_matrix", 9);  // column-major
    camera.fx = m[0];
    camera.fy = m[4];
    camera.cx = m[6];
    camera.cy = m[7];
    if (!(camera.fx > 0 && camera.fy > 0)) {
        object.fail("intrinsic_matrix", "focal lengths > 0",
                    fmt::format("fx = {}, fy = {}", camera.fx, camera.fy),
                    "The matrix is column-major: fx 0 0 0 fy 0 cx cy 1.");
    }
    if (m[8] != 1 || m[1] != 0 || m[2] != 0 || m[5] != 0) {
        object.fail("intrinsic_matrix", "fx 0 0 0 fy 0 cx cy 1 (column-major, no skew)",
                    "other entries", "Row-major? Transpose it.");
    }
    if (object.has("distortion")) {
        std::vector<double> d = object.numbers("distortion");
        if (d.size() > 5) object.fail("distortion", "at most k1 k2 p1 p2 k3", "more");
        d.resize(5, 0.0);
        intrinsic.distortion = {d[0], d[1], d[2], d[3], d[4]};
    }
    object.finish();
    return intrinsic;
}

}  // namespace vitrine
