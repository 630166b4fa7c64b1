#include "pipeline/scan_files.h"

#include "base/json_reader.h"
#include "capture/trajectory.h"
#include "geometry/mesh_io.h"
#include "image/image_io.h"
#include "scene/scene_json.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

fs::path silhouette_path(const fs::path& folder, const std::string& frame,
                         const std::string& object) {
    return folder / "silhouettes" / (frame + "_" + object + ".png");
}

}  // namespace

void write_scan(const fs::path& folder, const Scan& scan, const Capture& capture) {
    write_ply(folder / "mesh.ply", scan.mesh);
    Json json;
    json["schema"] = "vitrine.scan/1";
    json["support_plane"] = {{"normal", to_json(scan.support_plane.normal)},
                             {"offset_m", scan.support_plane.offset_m}};
    json["depth_residual_m"] = scan.depth_residual_m;
    json["frames"] = Json::array();
    std::vector<StampedPose> poses;
    for (std::size_t i = 0; i < scan.cameras.size(); ++i) {
        const FramePose& pose = scan.poses[i];
        const Rigid3 world_from_camera = scan.cameras[i].cam_from_world.inverse();
        poses.push_back({capture.frames[i].timestamp_s, world_from_camera});
        json["frames"].push_back({{"id", pose.id},
                                  {"is_tracked", pose.is_tracked},
                                  {"moved_m", pose.moved_m},
                                  {"turned_deg", degrees(pose.turned_rad)},
                                  {"residual_m", pose.residual_m},
                                  {"world_from_camera", to_json(world_from_camera.matrix())}});
    }
    json["notes"] = scan.notes;
    write_trajectory(folder / "trajectory.txt", poses);
    write_json_file(folder / "scan.json", json);
}

Scan read_scan(const fs::path& folder, const Capture& capture) {
    Scan scan;
    scan.mesh = read_ply(folder / "mesh.ply");
    const JsonObject object = read_json_file(folder / "scan.json");
    object.choice("schema", {"vitrine.scan/1"});
    const JsonObject plane = object.object("support_plane");
    scan.support_plane.normal = read_vec3(plane, "normal");
    scan.support_plane.offset_m = plane.number("offset_m");
    scan.depth_residual_m = object.number("depth_residual_m");
    const std::vector<JsonObject> frames = object.objects("frames");
    VITRINE_CHECK_EQ(frames.size(), capture.frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
        FramePose pose;
        pose.id = frames[i].text("id");
        pose.is_tracked = frames[i].boolean_or("is_tracked", true);
        pose.moved_m = frames[i].number("moved_m");
        pose.turned_rad = radians(frames[i].number("turned_deg"));
        pose.residual_m = frames[i].number("residual_m");
        scan.poses.push_back(pose);
        Camera camera = capture.frames[i].camera;
        // The text keeps all digits: what is read here is what was computed.
        const Mat4 matrix = read_matrix(frames[i], "world_from_camera");
        camera.cam_from_world =
            Rigid3{matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>()}.inverse();
        scan.cameras.push_back(camera);
    }
    scan.notes = object.texts("notes");
    return scan;
}

void write_candidates(const fs::path& folder, const Candidates& candidates,
                      const Capture& capture) {
    // Silhouettes of objects that an earlier run had found must not stay.
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    Json json;
    json["schema"] = "vitrine.candidates/1";
    json["objects"] = Json::array();
    for (const Candidate& object : candidates.objects) {
        write_ply(folder / (object.id + ".ply"), object.hull);
        Json seen = Json::array();
        for (std::size_t i = 0; i < object.silhouettes.size(); ++i) {
            if (object.silhouettes[i].empty()) continue;
            const std::string& frame = capture.frames[i].id;
            seen.push_back(frame);
            write_png(silhouette_path(folder, frame, object.id), object.silhouettes[i]);
        }
        const Box3 box = object.box;
        json["objects"].push_back({{"id", object.id},
                                   {"mesh", object.id + ".ply"},
                                   {"evidence", object.evidence},
                                   {"bad_depth_fraction", object.bad_depth_fraction},
                                   {"outline_residual_px", object.outline_residual_px},
                                   {"is_body_of_revolution", object.revolution.is_found},
                                   {"box_min_m", to_json(box.min)},
                                   {"box_max_m", to_json(box.max)},
                                   {"frames", seen}});
    }
    json["notes"] = candidates.notes;
    write_json_file(folder / "candidates.json", json);
}

Candidates read_candidates(const fs::path& folder, const Capture& capture) {
    Candidates candidates;
    const JsonObject object = read_json_file(folder / "candidates.json");
    object.choice("schema", {"vitrine.candidates/1"});
    for (const JsonObject& item : object.objects("objects")) {
        Candidate candidate;
        candidate.id = item.text("id");
        candidate.hull = read_ply(folder / item.text("mesh"));
        candidate.evidence = item.text("evidence");
        candidate.bad_depth_fraction = item.number("bad_depth_fraction");
        candidate.outline_residual_px = item.number("outline_residual_px");
        candidate.revolution.is_found = item.boolean_or("is_body_of_revolution", false);
        candidate.box = bounds(candidate.hull);
        candidate.silhouettes.resize(capture.frames.size());
        for (const std::string& frame : item.texts("frames")) {
            for (std::size_t i = 0; i < capture.frames.size(); ++i) {
                if (capture.frames[i].id != frame) continue;
                candidate.silhouettes[i] = read_mask(silhouette_path(folder, frame, candidate.id));
            }
        }
        candidates.objects.push_back(std::move(candidate));
    }
    candidates.notes = object.texts("notes");
    return candidates;
}

std::map<std::pair<std::string, std::string>, Mask> read_edited_silhouettes(
    const fs::path& folder, const Capture& capture) {
    std::map<std::pair<std::string, std::string>, Mask> edited;
    if (!fs::is_directory(folder)) return edited;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string stem = entry.path().stem().string();
        const RgbdFrame* match = nullptr;
        for (const RgbdFrame& frame : capture.frames) {
            const bool fits = stem.rfind(frame.id + "_", 0) == 0;
            if (fits && (match == nullptr || frame.id.size() > match->id.size())) match = &frame;
        }
        if (match == nullptr) {
            throw InputError({entry.path().string(), "a name like 000003_object_0.png",
                              entry.path().filename().string(),
                              "The part before the object's name is the id of a frame."});
        }
        Mask mask = read_mask(entry.path());
        if (mask.width() != match->camera.width || mask.height() != match->camera.height) {
            throw InputError(
                {entry.path().string(),
                 fmt::format("{} x {} pixels", match->camera.width, match->camera.height),
                 fmt::format("{} x {}", mask.width(), mask.height()), ""});
        }
        edited[{stem.substr(match->id.size() + 1), match->id}] = std::move(mask);
    }
    return edited;
}

}  // namespace vitrine
