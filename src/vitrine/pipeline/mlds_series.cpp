#include "pipeline/mlds_series.h"

#include "base/error.h"
#include "base/json_reader.h"
#include "base/text.h"
#include "perception/scale_json.h"
#include "scene/scene_json.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

std::size_t part_index(const Scene& scene, const std::string& name, const std::string& where) {
    std::vector<std::string> glass;
    for (std::size_t i = 0; i < scene.parts.size(); ++i) {
        if (!std::holds_alternative<Dielectric>(scene.parts[i].material)) continue;
        if (scene.parts[i].name == name) return i;
        glass.push_back(scene.parts[i].name);
    }
    throw InputError(
        {where, "the name of a dielectric part", "\"" + name + "\"",
         glass.empty() ? "the scene has none" : "the scene has: " + join(glass, ", ")});
}

}  // namespace

void check_series(const SeriesSpec& spec, const std::string& where) {
    if (spec.scene.cameras.empty()) throw InputError({where, "a scene with a camera", "none", ""});
    part_index(spec.scene, spec.part, where);
    if (spec.ior.size() < 4 || spec.ior.size() > 40) {
        throw InputError({where, "4 to 40 refractive indices", std::to_string(spec.ior.size()),
                          "ten give the 210 trials of the paper"});
    }
    for (std::size_t i = 0; i < spec.ior.size(); ++i) {
        const bool is_rising = i == 0 || spec.ior[i] > spec.ior[i - 1];
        if (!(spec.ior[i] > 1.0 && spec.ior[i] <= 3.0) || !is_rising) {
            throw InputError({where, "rising refractive indices above 1 and up to 3",
                              std::to_string(spec.ior[i]), ""});
        }
    }
}

SeriesSpec read_series_spec(const fs::path& path) {
    const JsonObject root = read_json_file(path);
    root.choice("schema", {"vitrine.mlds_series/1"});
    SeriesSpec spec;
    spec.title = root.text_or("title", path.stem().string());
    spec.part = root.text("part");
    if (root.raw("ior").is_object()) {
        const JsonObject range = root.object("ior");
        const long long count = range.integer_or("count", 10);
        if (count < 4 || count > 40) range.fail("count", "4 to 40", std::to_string(count));
        spec.ior = equal_steps(range.number("from"), range.number("to"), static_cast<int>(count));
        range.finish();
    } else {
        spec.ior = root.numbers("ior");
    }
    spec.scene = read_scene(resolve_inside(root, "scene", path.parent_path()));
    root.finish();
    check_series(spec, path.string());
    return spec;
}

Scene scene_at(const SeriesSpec& spec, double ior) {
    Scene scene = spec.scene;
    const std::size_t i = part_index(scene, spec.part, spec.title);
    std::get<Dielectric>(scene.parts[i].material).ior = ior;
    return scene;
}

}  // namespace vitrine
