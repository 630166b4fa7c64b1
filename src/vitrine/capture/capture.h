// capture/capture.h: a multi-view RGB-D capture as the stages see it: linear light, metres, poses.
#pragma once

#include "base/progress.h"
#include "geometry/camera.h"
#include "image/image.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vitrine {

struct RgbdFrame {
    std::string id;  ///< file stem of the colour picture
    double timestamp_s = 0.0;
    ImageRgb colour;        ///< linear radiance; clips at `Capture::saturation_level`
    ImageF depth_m;         ///< planar z, same size as colour; 0 = invalid
    Camera camera;          ///< pose is the identity when the capture has none
    double exposure = 1.0;  ///< relative exposure, already divided out of `colour`
};

/// A pixel whose diffuse albedo the user knows; it fixes the scale between light and albedo.
struct ReferenceAlbedo {
    std::string frame;
    Vec2 pixel = Vec2::Zero();
    Rgb albedo = Rgb::Constant(0.5f);
};

struct Capture {
    std::string name;
    std::vector<RgbdFrame> frames;
    double saturation_level = 1.0;  ///< linear; the frame that clips first, 1e30: never
    bool has_poses = false;
    std::optional<ReferenceAlbedo> reference_albedo;
    std::vector<std::string> warnings;  ///< one plain sentence each
};

/// A picture clips softly by sensor noise and encoding: from here on a pixel tells only "at least".
inline bool is_saturated(const Rgb& linear, double saturation_level) {
    return (linear >= static_cast<float>(0.98 * saturation_level)).any();
}

/// Reads a folder in one of the layouts of `capture_readers()` (read_capture.h), found by what it
/// holds: TUM RGB-D, nerfstudio, Polycam raw, COLMAP, Redwood/Open3D. capture.json counts in all.
/// Up to max(1, 5 %) damaged frames are dropped with a warning. Lens distortion is taken out, depth
/// of a camera of its own is registered to the colour picture. Recordings that would fill the
/// memory are thinned out. Costs about 15 ms per 640x360 frame.
/// @throws InputError when the folder cannot be used; the message says what, where and what to do.
Capture read_capture(const std::filesystem::path& folder, const Progress& progress = {});

}  // namespace vitrine
