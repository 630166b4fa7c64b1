// geometry/gltf_io.h: glTF 2.0 and GLB files: triangles and the numbers of their materials.
#pragma once

#include "geometry/mesh.h"

#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

/// Metallic-roughness numbers and the extensions that matter for glass; textures are not read.
struct GltfMaterial {
    std::string name;
    Rgb base_colour = Rgb::Constant(1.0f);  ///< linear
    double metallic = 1.0;
    double roughness = 1.0;
    double ior = 1.5;                 ///< KHR_materials_ior
    double transmission = 0.0;        ///< KHR_materials_transmission
    Rgb sigma_a_per_m = Rgb::Zero();  ///< KHR_materials_volume: -ln(colour) / distance
    bool has_texture = false;         ///< a colour texture that we leave out
};

struct GltfPrimitive {
    std::string name;
    Mesh mesh;  ///< node transforms applied; z up (glTF is y up), metres
    GltfMaterial material;
};

/// Reads all triangle primitives of the default scene.
/// @throws InputError for damage, indices out of range, buffers outside the file's folder, or a
/// required extension that we do not know.
std::vector<GltfPrimitive> read_gltf(const std::filesystem::path& path);

}  // namespace vitrine
