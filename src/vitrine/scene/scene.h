// scene/scene.h: cameras, parts and lights as plain values. No handle, no cache: the scene *with* a
// virtual object and the one *without* are two values, cheap to copy since meshes are shared.
#pragma once

#include "geometry/camera.h"
#include "geometry/mesh.h"
#include "scene/light.h"
#include "scene/material.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace vitrine {

struct Part {
    std::string name;
    std::shared_ptr<const Mesh> mesh;  ///< in world coordinates, metres
    Material material;
    std::string mesh_file;    ///< where it came from, for writing
    bool is_virtual = false;  ///< inserted, not part of the real scene
};

struct Scene {
    std::vector<Camera> cameras;
    std::vector<Part> parts;
    std::vector<Light> lights;
    Rgb ambient_radiance = Rgb::Zero();  ///< uniform environment
};

Box3 bounds(const Scene& scene);

/// Scene epsilon for leaving a surface along a ray: proportional to the scene, at least float
/// noise.
double ray_epsilon(const Scene& scene);

/// Reads "vitrine.scene/1"; mesh, texture and environment paths are relative to the file and may
/// not leave its folder. `world_from_part` is applied to the mesh.
/// @throws InputError
Scene read_scene(const std::filesystem::path& path);

/// Writes the scene with its meshes as PLY files beside it.
void write_scene(const std::filesystem::path& path, const Scene& scene);

}  // namespace vitrine
