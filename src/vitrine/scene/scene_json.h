// scene/scene_json.h: materials, lights and cameras as JSON, shared by every file that holds one.
// Include from .cpp files only.
#pragma once

#include "base/json_reader.h"
#include "scene/scene.h"

namespace vitrine {

Rgb read_rgb(const JsonObject& object, const std::string& key);
Vec3 read_vec3(const JsonObject& object, const std::string& key);
/// 16 numbers, row-major; the last row must be 0 0 0 1 and all finite.
Mat4 read_matrix(const JsonObject& object, const std::string& key);
/// A finite affine map whose linear part is a rotation.
Rigid3 read_rigid(const JsonObject& object, const std::string& key);

/// `folder` resolves the relative file names within.
Material read_material(const JsonObject& object, const std::filesystem::path& folder);
Light read_light(const JsonObject& object, const std::filesystem::path& folder);
Camera read_camera(const JsonObject& object);

Json to_json(const Rgb& rgb);
Json to_json(const Vec3& v);
Json to_json(const Mat4& row_major);
Json to_json(const Material& material);
Json to_json(const Light& light);
Json to_json(const Camera& camera);

/// `folder / name`, refused when it is absolute, leaves the folder or does not exist.
std::filesystem::path resolve_inside(const JsonObject& object, const std::string& key,
                                     const std::filesystem::path& folder);

/// The table of a "vitrine.translucent/1" file in metres. `scale_px_per_m` overrides the file's
/// own; one of them must be given.
Translucent read_translucent_file(const std::filesystem::path& path, double scale_px_per_m);

}  // namespace vitrine
