#include "render_truth.h"

#include "base/json_reader.h"
#include "geometry/mesh_io.h"
#include "image/image_io.h"
#include "scene/scene_json.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

constexpr double kTableSize = 1.2;  // m, of the albedo texture (note in scene.json)

Mat4 matrix_of_rows(const Json& rows) {
    Mat4 m;
    for (std::size_t i = 0; i < 16; ++i) {
        m(static_cast<int>(i / 4), static_cast<int>(i % 4)) = rows[i / 4][i % 4].get<double>();
    }
    return m;
}

Mesh read_smooth(const fs::path& path, double crease_deg) {
    Mesh mesh = welded(read_mesh(path), 1e-7);
    mesh.normals.clear();
    return crease_deg > 0 ? with_creased_normals(mesh, crease_deg) : mesh;
}

Material read_truth_material(const JsonObject& object, const fs::path& folder) {
    const std::string type = object.text("type");
    if (type == "lambert") {
        Diffuse diffuse;
        if (object.has("albedo_texture")) {
            diffuse.albedo_texture = std::make_shared<ImageRgb>(
                read_encoded_rgb(folder / object.text("albedo_texture")));
        } else {
            diffuse.albedo = read_rgb(object, "albedo");
        }
        return diffuse;
    }
    if (type.starts_with("smooth dielectric")) {
        return Dielectric{object.number("ior"), read_rgb(object, "sigma_a_per_metre")};
    }
    Ward ward;
    ward.rho_d = read_rgb(object, "rho_d");
    ward.rho_s = read_rgb(object, "rho_s");
    ward.sigma_x = ward.sigma_y = object.number("ward_sigma_equivalent");
    // The truth's Beckmann lobe over 4 cos cos is Duer's form but for 1 / cos^4 of the half vector.
    ward.form = WardForm::Duer;
    return ward;
}

}  // namespace

TruthScene read_truth(const fs::path& capture, double crease_deg) {
    const fs::path folder = capture / "truth";
    const JsonObject root = read_json_file(folder / "scene.json");
    TruthScene truth;
    truth.linear_scale = root.object("exposure").number("scale");
    truth.scene.ambient_radiance =
        Rgb::Constant(static_cast<float>(root.object("ambient").number("radiance_W_m2_sr")));
    for (const JsonObject& light : root.objects("lights")) {
        truth.scene.lights.push_back(
            DiscLight{read_vec3(light, "centre"), read_vec3(light, "normal").normalized(),
                      light.number("radius"), read_rgb(light, "point_intensity_W_sr")});
        truth.direct_level += light.numbers("direct_irradiance_at_reference")[1];
    }
    for (const JsonObject& object : root.objects("objects")) {
        Part part;
        part.name = object.text("name");
        Mesh mesh = read_smooth(folder / object.text("mesh"), crease_deg);
        part.material = read_truth_material(object.object("material"), folder);
        if (const auto* diffuse = std::get_if<Diffuse>(&part.material);
            diffuse && diffuse->albedo_texture) {
            for (const Vec3f& v : mesh.vertices) {
                mesh.uv.push_back((v.head<2>() / static_cast<float>(kTableSize)).array() + 0.5f);
            }
        }
        part.mesh = std::make_shared<Mesh>(std::move(mesh));
        truth.scene.parts.push_back(std::move(part));
    }
    const JsonObject intrinsics = root.object("camera");
    Camera camera;
    camera.width = static_cast<int>(intrinsics.integer("width"));
    camera.height = static_cast<int>(intrinsics.integer("height"));
    camera.fx = intrinsics.number("fx");
    camera.fy = intrinsics.number("fy");
    camera.cx = intrinsics.number("cx");
    camera.cy = intrinsics.number("cy");
    for (const JsonObject& view : root.objects("views")) {
        camera.id = fmt::format("{:06d}", view.integer("index"));
        const Mat4 pose = matrix_of_rows(view.raw("camera_to_world"));
        camera.cam_from_world =
            Rigid3{pose.topLeftCorner<3, 3>(), pose.topRightCorner<3, 1>()}.inverse();
        truth.scene.cameras.push_back(camera);
    }
    return truth;
}

Part read_truth_insert(const fs::path& folder, double crease_deg) {
    const JsonObject root = read_json_file(folder / "insert.json");
    Part part;
    part.name = "virtual";
    part.is_virtual = true;
    part.mesh = std::make_shared<Mesh>(read_smooth(folder / root.text("object"), crease_deg));
    part.material = read_truth_material(root.object("material"), folder);
    return part;
}

}  // namespace vitrine
