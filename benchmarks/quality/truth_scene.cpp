#include "truth_scene.h"

#include "base/json_reader.h"
#include "base/parallel.h"
#include "estimate/observations.h"
#include "geometry/mesh_io.h"
#include "reconstruct/labelled_scene.h"
#include "reconstruct/scan.h"
#include "scene/scene_json.h"

#include <fstream>
#include <map>

namespace vitrine {

namespace {

Json read_json(const std::filesystem::path& path) {
    std::ifstream in(path);
    return Json::parse(in);
}

Vec3 vec3(const Json& j) { return {j[0].get<double>(), j[1].get<double>(), j[2].get<double>()}; }
Rgb rgb(const Json& j) { return {j[0].get<float>(), j[1].get<float>(), j[2].get<float>()}; }

/// Splits the longest edges until none exceeds `edge_m`; shared edges split alike.
Mesh refined(const Mesh& mesh, float edge_m) {
    Mesh out;
    out.vertices = mesh.vertices;
    std::vector<Triangle> todo = mesh.triangles;
    std::map<std::pair<int, int>, int> middle;
    while (!todo.empty()) {
        const Triangle t = todo.back();
        todo.pop_back();
        int longest = 0;
        float length = 0;
        for (int e = 0; e < 3; ++e) {
            const float l = (out.vertices[static_cast<std::size_t>(t[e])] -
                             out.vertices[static_cast<std::size_t>(t[(e + 1) % 3])])
                                .norm();
            if (l > length) {
                length = l;
                longest = e;
            }
        }
        if (length <= edge_m) {
            out.triangles.push_back(t);
            continue;
        }
        const int a = t[longest], b = t[(longest + 1) % 3], c = t[(longest + 2) % 3];
        auto [entry, is_new] = middle.try_emplace({std::min(a, b), std::max(a, b)},
                                                  static_cast<int>(out.vertices.size()));
        if (is_new) {
            const Vec3f m = 0.5f * (out.vertices[static_cast<std::size_t>(a)] +
                                    out.vertices[static_cast<std::size_t>(b)]);
            out.vertices.push_back(m);
        }
        todo.emplace_back(a, entry->second, c);
        todo.emplace_back(entry->second, b, c);
    }
    return out;
}

void fill_unseen(Mesh& mesh, std::vector<char>& is_known) {
    for (int round = 0; round < 40; ++round) {
        std::vector<Rgb> sum(mesh.vertices.size(), Rgb::Zero());
        std::vector<float> count(mesh.vertices.size(), 0.0f);
        for (const Triangle& t : mesh.triangles)
            for (int e = 0; e < 3; ++e) {
                const auto a = static_cast<std::size_t>(t[e]);
                const auto b = static_cast<std::size_t>(t[(e + 1) % 3]);
                if (is_known[a]) sum[b] += mesh.colours[a], count[b] += 1;
                if (is_known[b]) sum[a] += mesh.colours[b], count[a] += 1;
            }
        for (std::size_t i = 0; i < count.size(); ++i)
            if (!is_known[i] && count[i] > 0) {
                mesh.colours[i] = sum[i] / count[i];
                is_known[i] = true;
            }
    }
}

}  // namespace

TrueScene read_truth(const std::filesystem::path& folder) {
    const Json j = read_json(folder / "truth" / "scene.json");
    TrueScene truth;
    truth.reference_point_m = vec3(j["reference_point"]);
    truth.ambient_radiance = Rgb::Constant(j["ambient"]["radiance_W_m2_sr"].get<float>());
    for (const Json& l : j["lights"])
        truth.lights.push_back({vec3(l["centre"]), vec3(l["normal"]), l["radius"].get<double>(),
                                rgb(l["point_intensity_W_sr"])});
    for (const Json& o : j["objects"]) {
        const std::string c = o["class"];
        if (c == "diffuse") continue;
        TrueObject object;
        object.name = o["name"];
        object.object_class = c;
        object.centroid = vec3(o["centroid"]);
        object.mesh = o["mesh"];
        const Json& m = o["material"];
        object.is_hollow = m["type"].get<std::string>().find("hollow") != std::string::npos;
        object.wall_m = o.value("wall_thickness_m", 0.0);
        if (c == "transparent") {
            object.ior = m["ior"];
            object.sigma_a_per_m = rgb(m["sigma_a_per_metre"]);
        } else {
            object.rho_d = rgb(m["rho_d"]);
            object.rho_s = rgb(m["rho_s"]);
            object.sigma = m["ward_sigma_equivalent"];
        }
        truth.objects.push_back(object);
    }
    return truth;
}

Scene make_true_geometry(const std::filesystem::path& folder, const Capture& capture) {
    const Json j = read_json(folder / "truth" / "scene.json");
    Mesh scan;
    std::vector<Part> objects;
    for (const Json& o : j["objects"]) {
        Mesh mesh = read_ply(folder / "truth" / o["mesh"].get<std::string>());
        if (o["class"] == "diffuse") {
            Mesh fine = refined(mesh, o["name"] == "floor" ? 0.08f : 0.005f);
            fine.normals.clear();
            append(scan, with_creased_normals(fine, 30.0));
        } else {
            if (mesh.normals.empty()) mesh = with_creased_normals(welded(mesh, 1e-6), 40.0);
            Part part;
            part.name = "object_" + std::to_string(objects.size());
            part.mesh = std::make_shared<const Mesh>(std::move(mesh));
            objects.push_back(std::move(part));
        }
    }
    Scene scene;
    for (const RgbdFrame& frame : capture.frames) scene.cameras.push_back(frame.camera);
    Part part;
    part.name = "scan";
    Diffuse diffuse;
    diffuse.use_vertex_colours = true;
    part.material = diffuse;
    scan.colours.assign(scan.vertices.size(), Rgb::Zero());
    part.mesh = std::make_shared<const Mesh>(scan);
    scene.parts.push_back(part);
    for (const Part& object : objects) scene.parts.push_back(object);

    const EstimationScene world(scene);
    const FrameLookup lookup(world, scene.cameras, capture.frames, capture.saturation_level);
    std::vector<FrameLookup::Seen> seen(scan.vertices.size());
    parallel_for(seen.size(), 256, [&](std::size_t i) {
        seen[i] = lookup.observe({scan.vertices[i], scan.normals[i]});
    });
    std::vector<char> is_known(seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
        is_known[i] = seen[i].views + seen[i].saturated > 0;
        scan.colours[i] = seen[i].views >= seen[i].saturated
                              ? seen[i].radiance
                              : Rgb(Rgb::Constant(static_cast<float>(capture.saturation_level)));
    }
    fill_unseen(scan, is_known);
    scene.parts[0].mesh = std::make_shared<const Mesh>(std::move(scan));
    return scene;
}

Scene cached_reconstruction(const Capture& capture, const std::filesystem::path& cache) {
    const std::filesystem::path file = cache / capture.name / "scene.json";
    if (std::filesystem::exists(file)) return read_scene(file);
    const Scan scan = make_scan(capture);
    const Scene scene = build_scene(scan, find_candidates(capture, scan));
    std::filesystem::create_directories(file.parent_path());
    write_scene(file, scene);
    return scene;
}

}  // namespace vitrine
