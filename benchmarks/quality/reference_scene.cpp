#include "reference_scene.h"

#include "base/json_reader.h"
#include "geometry/primitives.h"
#include "scene/scene_json.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

Part make_part(const std::string& name, Mesh mesh, Material material) {
    return {name, std::make_shared<Mesh>(std::move(mesh)), std::move(material), "", false};
}

Part read_part(const JsonObject& object, int sphere_rings, double ior) {
    const std::string name = object.text("name");
    if (name == "sphere") {
        return make_part(
            name, make_sphere(object.number("radius"), read_vec3(object, "centre"), sphere_rings),
            Dielectric{ior, Rgb::Zero()});
    }
    Diffuse diffuse;
    diffuse.albedo = read_rgb(object, "albedo_rgb");
    if (name == "box") {
        const Vec3 low = read_vec3(object, "min"), high = read_vec3(object, "max");
        return make_part(name, make_box(high - low, 0.5 * (low + high)), diffuse);
    }
    const auto x = object.numbers("x", 2), y = object.numbers("y", 2);
    Mesh mesh = make_plane(1.0);
    for (Vec3f& v : mesh.vertices) {
        v.x() = static_cast<float>(x[0] + (x[1] - x[0]) * (v.x() + 0.5));
        v.y() = static_cast<float>(y[0] + (y[1] - y[0]) * (v.y() + 0.5));
    }
    return make_part(name, std::move(mesh), diffuse);
}

Camera read_camera(const JsonObject& entry, const JsonObject& intrinsics) {
    Camera camera;
    camera.id = std::to_string(entry.integer("id"));
    camera.width = static_cast<int>(intrinsics.integer("width"));
    camera.height = static_cast<int>(intrinsics.integer("height"));
    camera.fx = intrinsics.number("fx");
    camera.fy = intrinsics.number("fy");
    // There pixel centres are at +0.5, here at integers.
    camera.cx = intrinsics.number("cx") - 0.5;
    camera.cy = intrinsics.number("cy") - 0.5;
    Mat4 pose;
    const Json& rows = entry.raw("camera_to_world");
    for (std::size_t i = 0; i < 16; ++i) {
        pose(static_cast<int>(i / 4), static_cast<int>(i % 4)) = rows[i / 4][i % 4].get<double>();
    }
    camera.cam_from_world =
        Rigid3{pose.topLeftCorner<3, 3>(), pose.topRightCorner<3, 1>()}.inverse();
    return camera;
}

}  // namespace

ReferenceScene read_reference_scene(const fs::path& folder, int sphere_rings) {
    const JsonObject root = read_json_file(folder / "ground_truth.json");
    ReferenceScene result;
    double ior = 0;
    for (const JsonObject& image : root.objects("images")) {
        result.pictures.push_back(folder / image.text("file"));
        ior = image.number("ior");
    }
    for (const JsonObject& entry : root.objects("cameras")) {
        result.scene.cameras.push_back(read_camera(entry, root.object("intrinsics")));
    }
    const JsonObject light = root.object("light");
    result.scene.lights.push_back(PointLight{read_vec3(light, "position"),
                                             read_rgb(light, "radiant_intensity_W_per_sr_rgb")});
    for (const JsonObject& object : root.objects("objects")) {
        const std::string name = object.text("name");
        if (name == "table") result.table = result.scene.parts.size();
        if (name == "sphere") result.sphere = result.scene.parts.size();
        result.scene.parts.push_back(read_part(object, sphere_rings, ior));
    }
    return result;
}

}  // namespace vitrine
