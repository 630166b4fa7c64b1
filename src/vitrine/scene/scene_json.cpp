#include "scene/scene_json.h"

#include "geometry/mesh_io.h"
#include "image/image_io.h"
#include "scene/insertion.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

void require_range(const JsonObject& object, const std::string& key, double value, double low,
                   double high) {
    if (value < low || value > high || !std::isfinite(value)) {
        object.fail(key, fmt::format("between {} and {}", low, high), fmt::format("{}", value));
    }
}

Rgb read_non_negative(const JsonObject& object, const std::string& key) {
    const Rgb value = read_rgb(object, key);
    if (!value.allFinite() || (value < 0).any()) {
        object.fail(key, "three numbers >= 0",
                    fmt::format("{} {} {}", value[0], value[1], value[2]));
    }
    return value;
}

Vec3 read_direction(const JsonObject& object, const std::string& key) {
    const Vec3 v = read_vec3(object, key);
    if (!(v.norm() > 0)) object.fail(key, "a direction", "zero length");
    return v.normalized();
}

Material read_diffuse(const JsonObject& object, const fs::path& folder) {
    Diffuse diffuse;
    if (object.has("albedo_texture")) {
        diffuse.albedo_texture_file = object.text("albedo_texture");
        diffuse.albedo_texture = std::make_shared<ImageRgb>(
            read_linear_rgb(resolve_inside(object, "albedo_texture", folder)));
    } else if (object.has("albedo") && object.raw("albedo").is_string()) {
        object.choice("albedo", {"vertex"});
        diffuse.use_vertex_colours = true;
    } else {
        diffuse.albedo = read_non_negative(object, "albedo");
        if ((diffuse.albedo > 1).any()) object.fail("albedo", "at most 1", "more");
    }
    return diffuse;
}

Material read_ward(const JsonObject& object) {
    Ward ward;
    ward.rho_d = read_non_negative(object, "rho_d");
    ward.rho_s = read_non_negative(object, "rho_s");
    if (object.has("sigma_x") || object.has("sigma_y")) {
        ward.sigma_x = object.number("sigma_x");
        ward.sigma_y = object.number("sigma_y");
    } else {
        ward.sigma_x = ward.sigma_y = object.number("sigma");
    }
    const std::string key = object.has("sigma") ? "sigma" : "sigma_x";
    require_range(object, key, ward.sigma_x, 0.001, 1.0);
    require_range(object, key, ward.sigma_y, 0.001, 1.0);
    if (object.has("form")) {
        ward.form =
            object.choice("form", {"ward", "duer"}) == "duer" ? WardForm::Duer : WardForm::Ward;
    }
    return ward;
}

Material read_translucent(const JsonObject& object, const fs::path& folder) {
    const double scale = object.number_or("scale_px_per_m", 0.0);
    if (object.has("scale_px_per_m")) require_range(object, "scale_px_per_m", scale, 1e-3, 1e9);
    const fs::path file = resolve_inside(object, "file", folder);
    Translucent translucent = read_translucent_file(file, scale);
    translucent.file = object.text("file");
    if (object.has("sigma")) {
        translucent.sigma = object.number("sigma");
        require_range(object, "sigma", translucent.sigma, 0.001, 1.0);
    }
    return translucent;
}

}  // namespace

Rgb read_rgb(const JsonObject& object, const std::string& key) {
    const std::vector<double> v = object.numbers(key, 3);
    return Rgb(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
}

Vec3 read_vec3(const JsonObject& object, const std::string& key) {
    const std::vector<double> v = object.numbers(key, 3);
    if (!std::isfinite(v[0] + v[1] + v[2])) object.fail(key, "finite numbers", "infinity");
    return {v[0], v[1], v[2]};
}

Mat4 read_matrix(const JsonObject& object, const std::string& key) {
    const std::vector<double> v = object.numbers(key, 16);
    Mat4 m;
    for (int i = 0; i < 16; ++i) m(i / 4, i % 4) = v[static_cast<std::size_t>(i)];
    if (!m.allFinite()) object.fail(key, "finite numbers", "infinity");
    if ((m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-9) {
        object.fail(key, "a row-major 4x4 matrix with last row 0 0 0 1", "another last row",
                    "Column-major? Transpose it.");
    }
    if (std::abs(m.topLeftCorner<3, 3>().determinant()) < 1e-12) {
        object.fail(key, "an invertible transform", "a singular one");
    }
    return m;
}

Rigid3 read_rigid(const JsonObject& object, const std::string& key) {
    const Mat4 m = read_matrix(object, key);
    if (!is_rotation(m.topLeftCorner<3, 3>(), 1e-3)) {
        object.fail(key, "a rotation and a translation", "scale, shear or mirroring");
    }
    Eigen::Quaterniond q(Mat3(m.topLeftCorner<3, 3>()));
    return Rigid3::from_quaternion(q, m.topRightCorner<3, 1>());
}

fs::path resolve_inside(const JsonObject& object, const std::string& key, const fs::path& folder) {
    const fs::path name = object.text(key);
    const fs::path inside = name.lexically_normal();
    if (name.is_absolute() || (!inside.empty() && *inside.begin() == "..")) {
        object.fail(key, "a path within the folder of the file", "\"" + name.string() + "\"");
    }
    if (!fs::is_regular_file(folder / inside)) {
        object.fail(key, "an existing file", "\"" + (folder / inside).string() + "\" is missing");
    }
    return folder / inside;
}

Material read_material(const JsonObject& object, const fs::path& folder) {
    const std::string kind =
        object.choice("kind", {"diffuse", "ward", "mirror", "dielectric", "translucent"});
    Material material;
    if (kind == "diffuse") {
        material = read_diffuse(object, folder);
    } else if (kind == "ward") {
        material = read_ward(object);
    } else if (kind == "mirror") {
        material = Mirror{read_non_negative(object, "reflectance")};
    } else if (kind == "dielectric") {
        Dielectric dielectric;
        dielectric.ior = object.number("ior");
        require_range(object, "ior", dielectric.ior, 1.0, 4.0);
        if (object.has("sigma_a_per_m")) {
            dielectric.sigma_a_per_m = read_non_negative(object, "sigma_a_per_m");
        }
        material = dielectric;
    } else {
        material = read_translucent(object, folder);
    }
    object.finish();
    return material;
}

Light read_light(const JsonObject& object, const fs::path& folder) {
    const std::string kind =
        object.choice("kind", {"point", "disc", "spot", "directional", "environment"});
    Light light;
    if (kind == "point") {
        light = PointLight{read_vec3(object, "position_m"),
                           read_non_negative(object, "intensity_w_per_sr")};
    } else if (kind == "disc") {
        DiscLight disc{read_vec3(object, "position_m"), read_direction(object, "normal"),
                       object.number("radius_m"), read_non_negative(object, "intensity_w_per_sr")};
        require_range(object, "radius_m", disc.radius_m, 1e-6, 1e3);
        light = disc;
    } else if (kind == "spot") {
        SpotLight spot{read_vec3(object, "position_m"), read_direction(object, "direction"),
                       read_non_negative(object, "intensity_w_per_sr"), object.number("cone_deg")};
        require_range(object, "cone_deg", spot.cone_deg, 0.1, 180.0);
        light = spot;
    } else if (kind == "directional") {
        light = DirectionalLight{read_direction(object, "direction"),
                                 read_non_negative(object, "irradiance_w_per_m2")};
    } else {
        EnvironmentLight environment;
        environment.file = object.text("file");
        environment.radiance =
            std::make_shared<ImageRgb>(read_linear_rgb(resolve_inside(object, "file", folder)));
        environment.scale = object.number_or("scale", 1.0);
        require_range(object, "scale", environment.scale, 0.0, 1e6);
        light = environment;
    }
    object.finish();
    return light;
}

Camera read_camera(const JsonObject& object) {
    Camera camera;
    camera.id = object.text("id");
    camera.width = static_cast<int>(object.integer("width"));
    camera.height = static_cast<int>(object.integer("height"));
    require_range(object, "width", camera.width, 1, 32768);
    require_range(object, "height", camera.height, 1, 32768);
    camera.fx = object.number("fx");
    camera.fy = object.number("fy");
    camera.cx = object.number("cx");
    camera.cy = object.number("cy");
    require_range(object, "fx", camera.fx, 1e-3, 1e7);
    require_range(object, "fy", camera.fy, 1e-3, 1e7);
    camera.cam_from_world = read_rigid(object, "world_from_camera").inverse();
    object.finish();
    return camera;
}

Json to_json(const Rgb& rgb) { return Json::array({rgb[0], rgb[1], rgb[2]}); }
Json to_json(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }
Json to_json(const Mat4& m) {
    Json list = Json::array();
    for (int i = 0; i < 16; ++i) list.push_back(m(i / 4, i % 4));
    return list;
}

Json to_json(const Material& material) {
    Json json;
    json["kind"] = kind_name(material);
    if (const auto* diffuse = std::get_if<Diffuse>(&material)) {
        if (diffuse->albedo_texture) {
            json["albedo_texture"] = diffuse->albedo_texture_file;
        } else if (diffuse->use_vertex_colours) {
            json["albedo"] = "vertex";
        } else {
            json["albedo"] = to_json(diffuse->albedo);
        }
    } else if (const auto* ward = std::get_if<Ward>(&material)) {
        json["rho_d"] = to_json(ward->rho_d);
        json["rho_s"] = to_json(ward->rho_s);
        if (ward->sigma_x == ward->sigma_y) {
            json["sigma"] = ward->sigma_x;
        } else {
            json["sigma_x"] = ward->sigma_x;
            json["sigma_y"] = ward->sigma_y;
        }
        json["form"] = ward->form == WardForm::Duer ? "duer" : "ward";
    } else if (const auto* mirror = std::get_if<Mirror>(&material)) {
        json["reflectance"] = to_json(mirror->reflectance);
    } else if (const auto* dielectric = std::get_if<Dielectric>(&material)) {
        json["ior"] = dielectric->ior;
        json["sigma_a_per_m"] = to_json(dielectric->sigma_a_per_m);
    } else if (const auto* translucent = std::get_if<Translucent>(&material)) {
        json["file"] = translucent->file;
        json["scale_px_per_m"] = translucent->scale_px_per_m;
        if (translucent->sigma > 0) json["sigma"] = translucent->sigma;
    }
    return json;
}

Json to_json(const Light& light) {
    Json json;
    json["kind"] = kind_name(light);
    if (const auto* point = std::get_if<PointLight>(&light)) {
        json["position_m"] = to_json(point->position_m);
        json["intensity_w_per_sr"] = to_json(point->intensity_w_per_sr);
    } else if (const auto* disc = std::get_if<DiscLight>(&light)) {
        json["position_m"] = to_json(disc->position_m);
        json["normal"] = to_json(disc->normal);
        json["intensity_w_per_sr"] = to_json(disc->intensity_w_per_sr);
        json["radius_m"] = disc->radius_m;
    } else if (const auto* spot = std::get_if<SpotLight>(&light)) {
        json["position_m"] = to_json(spot->position_m);
        json["direction"] = to_json(spot->direction);
        json["intensity_w_per_sr"] = to_json(spot->intensity_w_per_sr);
        json["cone_deg"] = spot->cone_deg;
    } else if (const auto* directional = std::get_if<DirectionalLight>(&light)) {
        json["direction"] = to_json(directional->direction);
        json["irradiance_w_per_m2"] = to_json(directional->irradiance_w_per_m2);
    } else if (const auto* environment = std::get_if<EnvironmentLight>(&light)) {
        json["file"] = environment->file;
        json["scale"] = environment->scale;
    }
    return json;
}

Json to_json(const Camera& camera) {
    Json json;
    json["id"] = camera.id;
    json["width"] = camera.width;
    json["height"] = camera.height;
    json["fx"] = camera.fx;
    json["fy"] = camera.fy;
    json["cx"] = camera.cx;
    json["cy"] = camera.cy;
    json["world_from_camera"] = to_json(camera.cam_from_world.inverse().matrix());
    return json;
}

Translucent read_translucent_file(const fs::path& path, double scale_px_per_m) {
    const JsonObject object = read_json_file(path);
    object.choice("schema", {"vitrine.translucent/1"});
    Translucent translucent;
    translucent.file = path.filename().string();
    translucent.scale_px_per_m =
        scale_px_per_m > 0 ? scale_px_per_m : object.number_or("scale_px_per_m", 0.0);
    if (translucent.scale_px_per_m <= 0) {
        object.fail(
            "scale_px_per_m", "a number > 0", "none",
            "Its photo's scale is unknown. Give \"scale_px_per_m\" beside the \"file\" that "
            "names this material, or lift it again with --source-px-per-m or "
            "--object-size-m.");
    }
    translucent.eta = object.number_or("eta", 1.3);
    require_range(object, "eta", translucent.eta, 1.0, 3.0);
    const JsonObject profile = object.object("profile");
    const double scale = translucent.scale_px_per_m;
    for (const double r : profile.numbers("r_px")) {
        if (!translucent.r_m.empty() && r / scale <= translucent.r_m.back()) {
            profile.fail("r_px", "increasing radii", fmt::format("{}", r));
        }
        translucent.r_m.push_back(r / scale);
    }
    const Json& rows = profile.raw("rd_per_px2");
    for (const Json& row : rows) {
        if (!row.is_array() || row.size() != 3)
            profile.fail("rd_per_px2", "rows of three", row.dump());
        Rgbd rd;
        for (std::size_t c = 0; c < 3; ++c)
            rd[static_cast<int>(c)] = row[c].get<double>() * scale * scale;
        translucent.rd_per_m2.push_back(rd);
    }
    if (translucent.r_m.size() < 2 || translucent.r_m.size() != translucent.rd_per_m2.size()) {
        profile.fail(
            "rd_per_px2", "as many rows as r_px, at least two",
            fmt::format("{} and {}", translucent.rd_per_m2.size(), translucent.r_m.size()));
    }
    return translucent;
}

Scene read_scene(const fs::path& path) {
    const JsonObject object = read_json_file(path);
    object.choice("schema", {"vitrine.scene/1"});
    const fs::path folder = path.parent_path();
    Scene scene;
    for (const JsonObject& camera : object.objects("cameras"))
        scene.cameras.push_back(read_camera(camera));
    for (const JsonObject& item : object.objects("parts")) {
        Part part;
        part.name = item.text("name");
        part.mesh_file = item.text("mesh");
        Mesh mesh = read_mesh(resolve_inside(item, "mesh", folder));
        if (item.has("world_from_part"))
            mesh = transformed(mesh, read_matrix(item, "world_from_part"));
        part.mesh = std::make_shared<Mesh>(std::move(mesh));
        part.material = read_material(item.object("material"), folder);
        item.finish();
        scene.parts.push_back(std::move(part));
    }
    for (const JsonObject& light : object.objects("lights")) {
        scene.lights.push_back(read_light(light, folder));
    }
    if (object.has("ambient_radiance")) {
        scene.ambient_radiance = read_non_negative(object, "ambient_radiance");
    }
    object.finish();
    return scene;
}

void write_scene(const fs::path& path, const Scene& scene) {
    Json json;
    json["schema"] = "vitrine.scene/1";
    json["cameras"] = Json::array();
    for (const Camera& camera : scene.cameras) json["cameras"].push_back(to_json(camera));
    json["parts"] = Json::array();
    for (const Part& part : scene.parts) {
        const std::string file = part.name + ".ply";
        write_ply(path.parent_path() / file, *part.mesh);
        Json item;
        item["name"] = part.name;
        item["mesh"] = file;
        item["material"] = to_json(part.material);
        json["parts"].push_back(item);
    }
    json["lights"] = Json::array();
    for (const Light& light : scene.lights) json["lights"].push_back(to_json(light));
    json["ambient_radiance"] = to_json(scene.ambient_radiance);
    write_json_file(path, json);
}

}  // namespace vitrine
