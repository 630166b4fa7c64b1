#include "pipeline/scan_files.h"

#include "base/json_reader.h"
#include "base/text.h"
#include "capture/trajectory.h"
#include "geometry/mesh_io.h"
#include "image/image_io.h"
#include "scene/scene_json.h"

#include <algorithm>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

fs::path silhouette_path(const fs::path& folder, const std::string& frame,
                         const std::string& object) {
    return folder / "silhouettes" / (frame + "_" + object + ".png");
}

const RgbdFrame& frame_of(const Capture& capture, const std::string& id) {
    const auto found = std::find_if(capture.frames.begin(), capture.frames.end(),
                                    [&](const RgbdFrame& frame) { return frame.id == id; });
    VITRINE_CHECK(found != capture.frames.end());
    return *found;
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
        poses.push_back({frame_of(capture, pose.id).timestamp_s, world_from_camera});
        json["frames"].push_back({{"id", pose.id},
                                  {"moved_m", pose.moved_m},
                                  {"turned_deg", degrees(pose.turned_rad)},
                                  {"residual_m", pose.residual_m},
                                  {"exposure_gain", pose.exposure_gain},
                                  {"world_from_camera", to_json(world_from_camera.matrix())}});
    }
    json["dropped"] = scan.dropped;
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
    for (std::size_t i = 0; i < frames.size(); ++i) {
        FramePose pose;
        pose.id = frames[i].text("id");
        pose.moved_m = frames[i].number("moved_m");
        pose.turned_rad = radians(frames[i].number("turned_deg"));
        pose.residual_m = frames[i].number("residual_m");
        pose.exposure_gain = frames[i].number("exposure_gain");
        scan.poses.push_back(pose);
        Camera camera = frame_of(capture, pose.id).camera;
        // The text keeps all digits: what is read here is what was computed.
        const Mat4 matrix = read_matrix(frames[i], "world_from_camera");
        camera.cam_from_world =
            Rigid3{matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>()}.inverse();
        scan.cameras.push_back(camera);
    }
    scan.dropped = object.texts("dropped");
    scan.notes = object.texts("notes");
    return scan;
}

namespace {

/// Silhouettes of a capture with too few views for shapes.
Json write_outlines(const fs::path& folder, const Candidates& candidates) {
    Json list = Json::array();
    for (const Outline& outline : candidates.outlines) {
        const std::string id = fmt::format("outline_{}", list.size());
        write_png(silhouette_path(folder, outline.frame, id), outline.silhouette);
        const PixelBox& box = outline.box;
        list.push_back({{"id", id},
                        {"frame", outline.frame},
                        {"box_px", {box.x0, box.y0, box.x1 - box.x0, box.y1 - box.y0}},
                        {"evidence", outline.evidence}});
    }
    return list;
}

}  // namespace

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
    if (!candidates.outlines.empty()) json["outlines"] = write_outlines(folder, candidates);
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

namespace {

Box3 read_world_box(const JsonObject& item) {
    Box3 box;
    box.min = read_vec3(item, "min_m");
    box.max = read_vec3(item, "max_m");
    if ((box.max.array() <= box.min.array()).any()) {
        item.fail("max_m", "greater than min_m in every coordinate", "a smaller one");
    }
    return box;
}

/// What stands on the support plane behind a rectangle of a picture: as wide as deep.
Box3 read_picture_box(const JsonObject& item, const Capture& capture, const Scan& scan) {
    const std::string id = item.text("frame");
    const Camera* camera = nullptr;
    std::vector<std::string> ids;
    for (std::size_t i = 0; i < scan.cameras.size(); ++i) {
        ids.push_back(scan.poses[i].id);
        if (scan.poses[i].id == id) camera = &scan.cameras[i];
    }
    if (!camera) item.fail("frame", "a frame of " + capture.name + " (" + join(ids, " ") + ")", id);
    const std::vector<double> px = item.numbers("box_px", 4);
    const double left = px[0], top = px[1], right = px[0] + px[2], bottom = px[1] + px[3];
    if (!(px[2] > 0 && px[3] > 0 && camera->sees({left, top}) && camera->sees({right, bottom}))) {
        item.fail(
            "box_px",
            fmt::format("x, y, width, height within {} x {} pixels", camera->width, camera->height),
            fmt::format("{:g}, {:g}, {:g}, {:g}", px[0], px[1], px[2], px[3]));
    }
    const Plane& plane = scan.support_plane;
    const Vec3 eye = camera->centre_in_world();
    const Vec3 down = camera->ray_in_world(0.5 * (left + right), bottom);
    const double fall = -down.dot(plane.normal);
    if (fall < 0.02) item.fail("box_px", "a lower edge on the support surface", "one above it");
    const Vec3 front = eye + plane.height(eye) / fall * down;  // where the object meets the plane
    const double radius = 0.5 * px[2] * camera->depth(front) / camera->fx;
    // The axis stands a radius behind the front; the top edge cuts it at the object's height.
    const Vec3 away = (down + fall * plane.normal).normalized();
    const Vec3 foot = front + radius * away;
    const Vec3 up = camera->ray_in_world(0.5 * (left + right), top);
    const double along = (foot - eye).dot(away) / std::max(1e-6, up.dot(away));
    const double height = std::max(plane.height(eye + along * up), 0.01);
    Box3 box;
    for (const Vec3& corner : {Vec3(-1, -1, 0), Vec3(1, 1, 0), Vec3(-1, 1, 1), Vec3(1, -1, 1)}) {
        const Vec3 local(radius * corner.x(), radius * corner.y(), height * corner.z());
        box.extend(foot + plane_from_world(plane).rotation.transpose() * local);
    }
    return box;
}

}  // namespace

std::vector<Box3> read_edited_boxes(const fs::path& file, const Capture& capture,
                                    const Scan& scan) {
    std::vector<Box3> boxes;
    if (!fs::exists(file)) return boxes;
    const JsonObject object = read_json_file(file);
    object.choice("schema", {"vitrine.boxes/1"});
    for (const JsonObject& item : object.objects("boxes")) {
        boxes.push_back(item.has("frame") ? read_picture_box(item, capture, scan)
                                          : read_world_box(item));
        item.finish();
    }
    object.finish();
    return boxes;
}

}  // namespace vitrine
