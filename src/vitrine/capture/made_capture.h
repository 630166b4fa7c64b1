// capture/made_capture.h: a small world of known truth as users' folders, for the tests of this
// floor: a textured floor z = 0 with a block on it.
#pragma once

#include "base/scratch_folder.h"
#include "capture/capture.h"
#include "capture/capture_config.h"

#include <functional>

namespace vitrine {

struct MadeCapture {
    int width = 96, height = 64, frames = 8;
    double focal_px = 80;
    double orbit_rad = 0.25;  ///< between frames
    LensDistortion distortion = {};
    std::function<double(int)> exposure = [](int) { return 1.0; };
    std::function<int(int)> blur_px = [](int) { return 0; };  ///< sideways, of a frame

    /// Cameras at several heights: from one height, a floor scaled with its depth is still a floor
    /// and no unit could be told.
    Camera camera(int frame) const;
    /// Pictures as the lens sees them.
    ImageRgb8 colour(int frame) const;
    Image<std::uint16_t> depth(int frame, double depth_scale) const;

    void write_pictures(const std::filesystem::path& colour_folder,
                        const std::filesystem::path& depth_folder, double depth_scale) const;
    void write_tum(const std::filesystem::path& folder) const;
    /// Row-major world_from_camera with the camera's axes as OpenGL has them, as nested JSON rows.
    std::string gl_rows(int frame) const;
};

std::string made_frame_name(int frame);  ///< "000003"

/// Planar z and a brightness of 0 to 1 at a pixel of an ideal pinhole.
struct MadePoint {
    double depth_m;
    double brightness;
};
MadePoint look_at_made_world(const Camera& camera, double u, double v);

/// What `read_capture` has to say against a folder; "no error" when nothing.
std::string capture_error(const std::filesystem::path& folder);

}  // namespace vitrine
