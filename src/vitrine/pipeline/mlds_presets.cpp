#include "pipeline/mlds_presets.h"

#include "base/error.h"
#include "base/json_reader.h"
#include "base/text.h"
#include "geometry/primitives.h"
#include "perception/scale_json.h"

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

constexpr int kPictureSize = 512;
constexpr double kLightDistance = 1.5;  // metres, as in the paper's captures
constexpr double kCameraDistance = 0.72;

Vec3 from_angles(double azimuth_deg, double elevation_deg, double distance) {
    const double a = radians(azimuth_deg), e = radians(elevation_deg);
    return distance * Vec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
}

/// What a picture shows: glass, shadow and caustic.
struct View {
    Vec3 centre;
    double width_m = 0;  ///< of the picture, at the centre's distance
};

Camera make_camera(const View& view) {
    Camera camera;
    camera.id = "000000";
    camera.width = camera.height = kPictureSize;
    camera.fx = camera.fy = kPictureSize * kCameraDistance / view.width_m;
    camera.cx = camera.cy = 0.5 * (kPictureSize - 1);
    const Vec3 eye = view.centre + from_angles(-90.0, 40.0, kCameraDistance);
    camera.cam_from_world = look_at(eye, view.centre, Vec3::UnitZ()).inverse();
    return camera;
}

Part make_part(const std::string& name, Mesh mesh, Material material) {
    if (mesh.normals.empty()) mesh.normals = vertex_normals(mesh);
    return {name, std::make_shared<const Mesh>(std::move(mesh)), std::move(material), "", false};
}

Mesh table() {
    Mesh mesh = make_plane(1.6);
    mesh.uv.clear();
    return mesh;
}

Mesh lifted(const Mesh& mesh, double z) {
    Mat4 move = Mat4::Identity();
    move(2, 3) = z;
    return transformed(mesh, move);
}

/// A solid bottle of clear glass, 13 cm high.
Mesh bottle() {
    const std::vector<Vec2> outline = {
        {0.000, 0.000},  {0.022, 0.000}, {0.026, 0.004}, {0.028, 0.020},  {0.028, 0.045},
        {0.027, 0.065},  {0.023, 0.080}, {0.015, 0.092}, {0.0105, 0.104}, {0.010, 0.118},
        {0.0115, 0.123}, {0.010, 0.128}, {0.000, 0.129}};
    // Rounded by a Catmull-Rom spline through the outline.
    std::vector<Vec2> profile;
    for (std::size_t i = 0; i + 1 < outline.size(); ++i) {
        const Vec2& p0 = outline[i == 0 ? 0 : i - 1];
        const Vec2 &p1 = outline[i], &p2 = outline[i + 1];
        const Vec2& p3 = outline[std::min(i + 2, outline.size() - 1)];
        constexpr int kSteps = 4;
        for (int k = 0; k < kSteps; ++k) {
            const double t = static_cast<double>(k) / kSteps;
            Vec2 p = 0.5 * (2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t * t +
                            (3 * p1 - p0 - 3 * p2 + p3) * t * t * t);
            p.x() = std::max(p.x(), 0.0);
            profile.push_back(p);
        }
    }
    profile.push_back(outline.back());
    return make_lathe(profile, 64);
}

/// A fluted cup with a thick floor: open, so the profile runs up outside and down inside.
Mesh cup() {
    std::vector<Vec2> profile = {{0.0, 0.0}};
    constexpr int kSteps = 14;
    for (int k = 0; k <= kSteps; ++k) {
        const double t = static_cast<double>(k) / kSteps;
        profile.emplace_back(0.024 + 0.011 * t + 0.0035 * std::sin(kPi * t), 0.075 * t);
    }
    for (int k = kSteps; k >= 0; --k) {
        const double t = static_cast<double>(k) / kSteps;
        profile.emplace_back(0.0205 + 0.011 * t + 0.0035 * std::sin(kPi * t), 0.009 + 0.066 * t);
    }
    profile.emplace_back(0.0, 0.009);
    return make_lathe(profile, 64);
}

/// The fine shape: an upright pane whose front is rippled, so that it draws a net of light. Ripples
/// focus behind the pane's foot and before its top; each bends light once, far from total
/// reflection, so that no pattern is finer than a pixel.
Mesh pane() {
    constexpr int kCells = 64;
    constexpr double kSide = 0.07, kThickness = 0.008;  // metres
    constexpr double kYawDeg = 30.0;
    const auto ripple = [](double x, double z) {
        constexpr double kHeight = 0.0002, kPerMetre = 420.0;
        return kHeight * (std::sin(kPerMetre * (0.95 * x + 0.31 * z)) +
                          std::sin(kPerMetre * (0.38 * x - 0.73 * z) + 1.0) +
                          std::sin(kPerMetre * (0.61 * x + 0.52 * z) + 2.0));
    };
    Mesh mesh;
    // One face after the other, with corners of its own: the edges stay sharp.
    const auto add_face = [&](const auto& at, int columns, int rows) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (int j = 0; j <= rows; ++j) {
            for (int i = 0; i <= columns; ++i) {
                mesh.vertices.push_back(
                    at(static_cast<double>(i) / columns, static_cast<double>(j) / rows)
                        .template cast<float>());
            }
        }
        const auto stride = static_cast<std::uint32_t>(columns) + 1;
        for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rows); ++j) {
            for (std::uint32_t i = 0; i + 1 < stride; ++i) {
                const std::uint32_t a = first + j * stride + i, b = a + stride;
                mesh.triangles.emplace_back(a, a + 1, b + 1);
                mesh.triangles.emplace_back(a, b + 1, b);
            }
        }
    };
    const auto front = [&](double u, double v) {
        const double x = kSide * (u - 0.5), z = kSide * v;
        return Vec3(x, -0.5 * kThickness - ripple(x, z), z);
    };
    const auto back = [&](double u, double v) {
        return Vec3(kSide * (u - 0.5), 0.5 * kThickness, kSide * v);
    };
    const auto between = [](const Vec3& a, const Vec3& b, double t) -> Vec3 {
        return a + (b - a) * t;
    };
    add_face(front, kCells, kCells);
    add_face([&](double u, double v) { return back(1 - u, v); }, kCells, kCells);
    add_face([&](double u, double v) { return between(front(u, 1), back(u, 1), v); }, kCells, 1);
    add_face([&](double u, double v) { return between(back(u, 0), front(u, 0), v); }, kCells, 1);
    add_face([&](double u, double v) { return between(front(1, v), back(1, v), u); }, 1, kCells);
    add_face([&](double u, double v) { return between(back(0, v), front(0, v), u); }, 1, kCells);
    mesh.normals = vertex_normals(mesh);
    Mat4 place = Mat4::Identity();
    place.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(radians(kYawDeg)).toRotationMatrix();
    place(2, 3) = 0.0005;
    return transformed(mesh, place);
}

/// A table, glass on it, and dim light from all around.
SeriesSpec on_table(const std::string& title, Mesh glass, Light light, const View& view,
                    double from, double to) {
    SeriesSpec spec;
    spec.title = title;
    spec.part = "glass";
    spec.ior = equal_steps(from, to, 10);
    spec.scene.cameras.push_back(make_camera(view));
    Diffuse diffuse;
    diffuse.albedo = Rgb(0.62f, 0.60f, 0.56f);
    spec.scene.parts.push_back(make_part("table", table(), diffuse));
    spec.scene.parts.push_back(make_part("glass", std::move(glass), Dielectric{}));
    spec.scene.lights.push_back(std::move(light));
    spec.scene.ambient_radiance = Rgb::Constant(0.06f);
    return spec;
}

}  // namespace

std::vector<std::string> mlds_preset_names() {
    return {"sphere_point", "bottle_point", "pane_disc", "cup_spot"};
}

SeriesSpec make_mlds_preset(const std::string& name) {
    // Lamps stand so low that the caustic lies beyond its focus, where it is large enough to be
    // told from its neighbours and seldom brighter than the display's white.
    if (name == "sphere_point") {
        return on_table("Glass ball under a point light",
                        make_sphere(0.035, Vec3(-0.02, 0, 0.0355), 44),
                        PointLight{from_angles(165.0, 38.0, kLightDistance), Rgb::Constant(2.2f)},
                        {Vec3(0.018, 0, 0.018), 0.17}, 1.400, 1.465);
    }
    if (name == "bottle_point") {
        return on_table("Glass bottle under a point light", lifted(bottle(), 0.0005),
                        PointLight{from_angles(172.0, 50.0, kLightDistance), Rgb::Constant(2.2f)},
                        {Vec3(0.042, 0, 0.038), 0.215}, 1.500, 1.565);
    }
    if (name == "pane_disc") {
        const Vec3 at = from_angles(140.0, 46.0, kLightDistance);
        return on_table("Rippled pane under a small area light", pane(),
                        DiscLight{at, -at.normalized(), 0.03, Rgb::Constant(2.2f)},
                        {Vec3(0.016, -0.01, 0.02), 0.185}, 1.300, 1.380);
    }
    if (name == "cup_spot") {
        const Vec3 at = from_angles(168.0, 46.0, kLightDistance);
        return on_table("Glass cup under a spot light", lifted(cup(), 0.0005),
                        SpotLight{at, -at.normalized(), Rgb::Constant(2.2f), 30.0},
                        {Vec3(0.036, 0, 0.02), 0.195}, 1.300, 1.375);
    }
    throw InputError({"preset", "one of " + join(mlds_preset_names(), ", "), name, ""});
}

void write_mlds_presets(const std::filesystem::path& folder) {
    for (const std::string& name : mlds_preset_names()) {
        const SeriesSpec spec = make_mlds_preset(name);
        write_scene(folder / name / "scene.json", spec.scene);
        Json root;
        root["schema"] = "vitrine.mlds_series/1";
        root["title"] = spec.title;
        root["scene"] = name + "/scene.json";
        root["part"] = spec.part;
        root["ior"] = spec.ior;
        write_json_file(folder / (name + ".json"), root);
    }
}

}  // namespace vitrine
