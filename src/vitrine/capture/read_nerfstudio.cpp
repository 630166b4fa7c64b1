// nerfstudio: transforms.json with intrinsics (for all or per frame), OpenGL poses and the paths of
// the pictures. Pixel centres lie at +0.5 there.
#include "base/json_reader.h"
#include "capture/capture_listing.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

/// A value of the frame, else of the whole file.
double setting(const JsonObject& frame, const JsonObject& all, const char* key, double fallback) {
    const double shared = all.number_or(key, fallback);
    return frame.number_or(key, shared);
}

CameraIntrinsic intrinsic_of(const JsonObject& frame, const JsonObject& all) {
    CameraIntrinsic intrinsic;
    Camera& camera = intrinsic.camera;
    const double width = setting(frame, all, "w", 0), height = setting(frame, all, "h", 0);
    if (!(width >= 1 && height >= 1 && width <= 65536 && height <= 65536)) {
        all.fail("w", "the pictures' size w, h", fmt::format("{:g} x {:g}", width, height));
    }
    camera.width = static_cast<int>(width);
    camera.height = static_cast<int>(height);
    camera.fx = setting(frame, all, "fl_x", 0);
    camera.fy = setting(frame, all, "fl_y", camera.fx);
    camera.cx = setting(frame, all, "cx", 0.5 * width) - 0.5;
    camera.cy = setting(frame, all, "cy", 0.5 * height) - 0.5;
    if (!(camera.fx > 0 && camera.fy > 0)) {
        all.fail("fl_x", "focal lengths > 0",
                 fmt::format("fl_x = {:g}, fl_y = {:g}", camera.fx, camera.fy));
    }
    LensDistortion& d = intrinsic.distortion;
    d = {setting(frame, all, "k1", 0), setting(frame, all, "k2", 0), setting(frame, all, "p1", 0),
         setting(frame, all, "p2", 0), setting(frame, all, "k3", 0)};
    if (setting(frame, all, "k4", 0) != 0) {
        all.fail("k4", "k1 k2 p1 p2 k3 only (Brown's model)", "a fourth radial coefficient",
                 "Undistort the pictures first (ns-process-data does).");
    }
    return intrinsic;
}

Mat4 matrix_of(const JsonObject& frame, const char* key) {
    const Json& rows = frame.raw(key);
    Mat4 m = Mat4::Identity();
    const bool has_rows = rows.is_array() && (rows.size() == 4 || rows.size() == 3);
    for (std::size_t r = 0; has_rows && r < rows.size(); ++r) {
        if (!rows[r].is_array() || rows[r].size() != 4) frame.fail(key, "rows of 4 numbers", "");
        for (std::size_t c = 0; c < 4; ++c) {
            if (!rows[r][c].is_number()) frame.fail(key, "numbers", rows[r][c].dump());
            m(static_cast<int>(r), static_cast<int>(c)) = rows[r][c].get<double>();
        }
    }
    if (!has_rows) frame.fail(key, "a matrix of 4 rows", rows.type_name());
    return m;
}

}  // namespace

bool is_nerfstudio(const fs::path& folder) { return fs::exists(folder / "transforms.json"); }

CaptureListing list_nerfstudio(const fs::path& folder) {
    CaptureListing listing = start_listing(folder, 1000.0);
    listing.metres_per_unit = listing.config.metres_per_unit.value_or(1.0);
    listing.allows_scaled_depth = true;
    const fs::path file = folder / "transforms.json";
    listing.metadata.push_back(file);
    const JsonObject all = read_json_file(file);
    all.ignore_rest();  // other tools' keys are none of our business
    const std::string model = all.text_or("camera_model", "OPENCV");
    if (model != "OPENCV" && model != "PINHOLE" && model != "SIMPLE_PINHOLE") {
        all.fail("camera_model", "OPENCV, PINHOLE or SIMPLE_PINHOLE", "\"" + model + "\"",
                 "Undistort the pictures first.");
    }
    const std::vector<JsonObject> frames = all.objects("frames");
    if (frames.empty()) all.fail("frames", "at least one frame", "none");
    for (const JsonObject& item : frames) {
        item.ignore_rest();
        if (!item.has("depth_file_path")) continue;
        ListedFrame frame;
        frame.colour_file = path_inside(folder, item.text("file_path"), file.string());
        if (!frame.colour_file.has_extension()) {
            frame.colour_file = picture_of_stem(frame.colour_file.parent_path(),
                                                frame.colour_file.filename().string());
        }
        frame.depth_file = path_inside(folder, item.text("depth_file_path"), file.string());
        frame.id = frame.colour_file.stem().string();
        frame.timestamp_s = static_cast<double>(listing.frames.size());
        frame.intrinsic = intrinsic_of(item, all);
        frame.cam_from_world = cam_from_world_of_gl(
            matrix_of(item, "transform_matrix"),
            fmt::format("{}, transform_matrix of {}", file.string(), frame.id));
        listing.frames.push_back(std::move(frame));
    }
    require_most(listing.frames.size(), frames.size(), file.string(),
                 "depth_file_path for at least 80 % of the frames",
                 "Vitrine measures glass against depth: colour alone will not do.");
    if (listing.frames.size() < frames.size()) {
        listing.warnings.push_back(
            fmt::format("{} of {} frames have no depth_file_path and are left out",
                        frames.size() - listing.frames.size(), frames.size()));
    }
    listing.has_poses = listing.config.poses != PoseSource::None;
    return listing;
}

}  // namespace vitrine
