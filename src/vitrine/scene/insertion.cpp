#include "scene/insertion.h"

#include "geometry/mesh_io.h"
#include "scene/scene_json.h"

namespace vitrine {

Insertion read_insertion(const std::filesystem::path& path) {
    const JsonObject object = read_json_file(path);
    object.choice("schema", {"vitrine.insertion/1"});
    const std::filesystem::path folder = path.parent_path();
    Insertion insertion;
    for (const JsonObject& item : object.objects("objects")) {
        Part part;
        part.name = fmt::format("virtual_{}", insertion.objects.size());
        part.is_virtual = true;
        part.mesh_file = item.text("mesh");
        Mesh mesh = read_mesh(resolve_inside(item, "mesh", folder));
        if (item.has("to_world")) mesh = transformed(mesh, read_matrix(item, "to_world"));
        part.material = item.has("material") ? read_material(item.object("material"), folder)
                                             : Material(Diffuse{});
        // A crease of 35 degrees keeps the edges of boxes and rounds the facets of curved meshes.
        if (mesh.normals.empty()) mesh = with_creased_normals(welded(mesh, 1e-7), 35.0);
        part.mesh = std::make_shared<Mesh>(std::move(mesh));
        item.finish();
        insertion.objects.push_back(std::move(part));
    }
    if (insertion.objects.empty()) object.fail("objects", "at least one object", "none");
    if (object.has("frames")) {
        if (object.raw("frames").is_string()) {
            object.choice("frames", {"all"});
        } else {
            insertion.frames = object.texts("frames");
        }
    }
    object.finish();
    return insertion;
}

}  // namespace vitrine
