// scene/virtual_object.h: a mesh file becomes parts that can be inserted.
#pragma once

#include "scene/scene.h"

#include <optional>

namespace vitrine {

/// Meshes as they are in the file; placed and given materials by `make_virtual_parts`.
struct VirtualMesh {
    Mesh mesh;
    std::optional<Material> own_material;  ///< mapped from the file (glTF)
};

/// Reads .ply, .obj, .gltf or .glb. A glTF file may hold several meshes; its metallic-roughness
/// materials become diffuse, ward (metallic >= 0.5) or dielectric (transmission >= 0.5), and
/// `notes` says so.
std::vector<VirtualMesh> read_virtual_meshes(const std::filesystem::path& path,
                                             std::vector<std::string>& notes);

/// Parts "virtual_<first_index>".. in the world. `material` wins over the file's own; without
/// either the object is matte with albedo 0.7. Meshes without normals get creased ones.
/// @throws InputError when a mesh that is to be glass is not closed and welding does not close it;
/// the message counts its open and non-manifold edges. A mesh turned inside out is turned back.
std::vector<Part> make_virtual_parts(const std::vector<VirtualMesh>& meshes,
                                     const std::filesystem::path& file, const Mat4& world_from_mesh,
                                     const std::optional<Material>& material,
                                     std::size_t first_index, std::vector<std::string>& notes);

}  // namespace vitrine
