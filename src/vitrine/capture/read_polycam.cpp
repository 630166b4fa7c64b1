// Polycam's raw export: keyframes/{images,cameras,depth}/<stamp>.*; poses in ARKit's axes (camera
// as in OpenGL, world y up), depth in millimetres, coarser than the pictures. The optimised
// pictures and cameras (corrected_*) are taken where they exist.
#include "base/json_reader.h"
#include "base/text.h"
#include "capture/capture_listing.h"

#include <algorithm>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

Camera camera_of(const JsonObject& json) {
    Camera camera;
    camera.width = static_cast<int>(json.integer("width"));
    camera.height = static_cast<int>(json.integer("height"));
    camera.fx = json.number("fx");
    camera.fy = json.number("fy");
    camera.cx = json.number("cx");
    camera.cy = json.number("cy");
    if (camera.width < 1 || camera.height < 1) json.fail("width", "a size > 0", "none");
    if (!(camera.fx > 0 && camera.fy > 0)) json.fail("fx", "focal lengths > 0", "none");
    return camera;
}

/// Turned so that z is up, as everywhere here: (x, y, z) of ARKit becomes (z, x, y).
Mat4 world_from_gl(const JsonObject& json) {
    Mat4 m = Mat4::Identity();
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) m((r + 1) % 3, c) = json.number(fmt::format("t_{}{}", r, c));
    }
    return m;
}

}  // namespace

bool is_polycam(const fs::path& folder) { return fs::is_directory(folder / "keyframes"); }

CaptureListing list_polycam(const fs::path& folder) {
    CaptureListing listing = start_listing(folder, 1000.0);
    listing.allows_scaled_depth = true;
    const fs::path root = folder / "keyframes";
    const bool is_corrected =
        fs::is_directory(root / "corrected_images") && fs::is_directory(root / "corrected_cameras");
    const fs::path cameras = root / (is_corrected ? "corrected_cameras" : "cameras");
    const std::vector<fs::path> pictures =
        pictures_in(root / (is_corrected ? "corrected_images" : "images"));
    if (pictures.empty()) {
        throw InputError({root.string(), "pictures in images/ or corrected_images/", "none",
                          "Export as \"raw data\" with developer mode on."});
    }
    for (const fs::path& picture : pictures) {
        ListedFrame frame;
        frame.id = picture.stem().string();
        frame.colour_file = picture;
        frame.depth_file = picture_of_stem(root / "depth", frame.id);
        const fs::path camera_file = cameras / (frame.id + ".json");
        if (frame.depth_file.empty() || !fs::exists(camera_file)) continue;
        const JsonObject json = read_json_file(camera_file);
        json.ignore_rest();
        frame.intrinsic.camera = camera_of(json);
        frame.cam_from_world = cam_from_world_of_gl(world_from_gl(json), camera_file.string());
        double stamp = 0;  // file names are microseconds
        frame.timestamp_s = parse_double(frame.id, stamp)
                                ? 1e-6 * stamp
                                : static_cast<double>(listing.frames.size());
        listing.metadata.push_back(camera_file);
        listing.frames.push_back(std::move(frame));
    }
    require_most(listing.frames.size(), pictures.size(), root.string(),
                 "depth and a camera for at least 80 % of the pictures",
                 "Depth is only recorded in LiDAR mode.");
    if (listing.frames.size() < pictures.size()) {
        listing.warnings.push_back(
            fmt::format("{} of {} pictures have no depth or no camera and are left out",
                        pictures.size() - listing.frames.size(), pictures.size()));
    }
    listing.has_poses = listing.config.poses != PoseSource::None;
    return listing;
}

}  // namespace vitrine
