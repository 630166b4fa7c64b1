#include "scene/insertion.h"

#include "scene/scene_json.h"
#include "scene/virtual_object.h"

namespace vitrine {

Insertion read_insertion(const std::filesystem::path& path) {
    const JsonObject object = read_json_file(path);
    object.choice("schema", {"vitrine.insertion/1"});
    const std::filesystem::path folder = path.parent_path();
    Insertion insertion;
    for (const JsonObject& item : object.objects("objects")) {
        const std::filesystem::path file = resolve_inside(item, "mesh", folder);
        const Mat4 world_from_mesh =
            item.has("to_world") ? read_matrix(item, "to_world") : Mat4(Mat4::Identity());
        std::optional<Material> material;
        if (item.has("material")) material = read_material(item.object("material"), folder);
        item.finish();
        for (Part& part :
             make_virtual_parts(read_virtual_meshes(file, insertion.notes), file, world_from_mesh,
                                material, insertion.objects.size(), insertion.notes)) {
            insertion.objects.push_back(std::move(part));
        }
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
