#include "scene/virtual_object.h"

#include "base/error.h"
#include "geometry/gltf_io.h"
#include "geometry/mesh_io.h"

namespace vitrine {
namespace {

constexpr double kCrease_deg = 35.0;  // keeps the edges of boxes, rounds facets of curved meshes
constexpr double kWeldShare = 1e-6;   // of the diagonal: seams of exporters, not gaps
constexpr double kMatteAlbedo = 0.7;  // white paint

Material map_material(const GltfMaterial& gltf) {
    if (gltf.transmission >= 0.5) return Dielectric{gltf.ior, gltf.sigma_a_per_m};
    if (gltf.metallic >= 0.5) {
        // glTF squares its roughness to the width of the lobe; Ward's sigma is that width.
        const double sigma = std::clamp(gltf.roughness * gltf.roughness, 0.02, 1.0);
        return Ward{Rgb::Zero(), gltf.base_colour, sigma, sigma, WardForm::Ward};
    }
    return Diffuse{gltf.base_colour.min(1.0f).max(0.0f), nullptr, "", false};
}

/// Glass and translucent bodies have an inside.
Mesh closed_body(const Mesh& mesh, const std::string& what, const std::filesystem::path& file,
                 std::vector<std::string>& notes) {
    Mesh result = mesh;
    if (!find_defects(result).is_closed()) {
        result = welded(mesh, kWeldShare * bounds(mesh).size().norm());
        const MeshDefects defects = find_defects(result);
        if (!defects.is_closed()) {
            throw InputError({file.string(),
                              "a closed mesh for " + what + " (each edge used twice)",
                              fmt::format("{} open and {} non-manifold edges",
                                          defects.boundary_edges, defects.non_manifold_edges),
                              "Close its holes in a modeller, or give it another material."});
        }
        result.normals.clear();
        notes.push_back(fmt::format("{}: seams welded to close it", file.filename().string()));
    }
    if (volume(result) < 0) {
        for (Triangle& t : result.triangles) std::swap(t[1], t[2]);
        for (Vec3f& n : result.normals) n = -n;
        notes.push_back(
            fmt::format("{}: it was inside out and has been turned", file.filename().string()));
    }
    return result;
}

}  // namespace

std::vector<VirtualMesh> read_virtual_meshes(const std::filesystem::path& path,
                                             std::vector<std::string>& notes) {
    const std::string extension = path.extension().string();
    std::vector<VirtualMesh> meshes;
    if (extension != ".gltf" && extension != ".glb") {
        meshes.push_back({read_mesh(path), std::nullopt});
        return meshes;
    }
    for (GltfPrimitive& primitive : read_gltf(path)) {
        const Material material = map_material(primitive.material);
        notes.push_back(
            fmt::format("{}: material \"{}\" is taken as {}{}", path.filename().string(),
                        primitive.material.name, kind_name(material),
                        primitive.material.has_texture ? ", its texture left out" : ""));
        meshes.push_back({std::move(primitive.mesh), material});
    }
    return meshes;
}

std::vector<Part> make_virtual_parts(const std::vector<VirtualMesh>& meshes,
                                     const std::filesystem::path& file, const Mat4& world_from_mesh,
                                     const std::optional<Material>& material,
                                     std::size_t first_index, std::vector<std::string>& notes) {
    std::vector<Part> parts;
    for (const VirtualMesh& virtual_mesh : meshes) {
        Part part;
        part.name = fmt::format("virtual_{}", first_index + parts.size());
        part.is_virtual = true;
        part.mesh_file = file.filename().string();
        part.material = material ? *material
                        : virtual_mesh.own_material
                            ? *virtual_mesh.own_material
                            : Material(Diffuse{Rgb::Constant(kMatteAlbedo), nullptr, "", false});
        Mesh mesh = transformed(virtual_mesh.mesh, world_from_mesh);
        const bool is_glass = std::holds_alternative<Dielectric>(part.material);
        if (is_glass || std::holds_alternative<Translucent>(part.material)) {
            mesh = closed_body(mesh, is_glass ? "glass" : "a translucent body", file, notes);
        }
        if (mesh.normals.empty()) mesh = with_creased_normals(welded(mesh, 1e-7), kCrease_deg);
        part.mesh = std::make_shared<Mesh>(std::move(mesh));
        parts.push_back(std::move(part));
    }
    return parts;
}

}  // namespace vitrine
