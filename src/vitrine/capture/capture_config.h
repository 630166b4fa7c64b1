// capture/capture_config.h: capture.json and camera_intrinsic.json as values.
#pragma once

#include "capture/capture.h"

#include <map>

namespace vitrine {

enum class ColourSpace { Srgb, Linear };
enum class PoseSource { Trajectory, None };

struct CaptureConfig {
    std::optional<double> depth_scale;  ///< depth code per metre; not set: as the layout has it
    ColourSpace colour_space = ColourSpace::Srgb;
    double linear_scale = 1.0;        ///< linear radiance of a full code
    double black_level = 0.0;         ///< code / full code that means no light
    std::optional<PoseSource> poses;  ///< not set: a trajectory if there is one
    std::map<std::string, double> exposure;
    std::optional<ReferenceAlbedo> reference_albedo;
    std::optional<Rigid3> colour_from_depth;  ///< a depth camera of its own stands there
    std::optional<double> metres_per_unit;    ///< of poses in a unit of their own (COLMAP)
};

/// k1 k2 p1 p2 k3 of Brown's model, as OpenCV orders them.
struct LensDistortion {
    double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
    bool is_none() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
    /// Maps ideal normalised coordinates (x/z, y/z) to distorted ones.
    Vec2 distort(const Vec2& ideal) const;
    /// The inverse, by fixed-point iteration: to 1e-9 for lenses that bend less than a third.
    Vec2 undistort(const Vec2& bent) const;
};

struct CameraIntrinsic {
    Camera camera;  ///< identity pose
    LensDistortion distortion;
};

CaptureConfig read_capture_config(const std::filesystem::path& path);
CameraIntrinsic read_camera_intrinsic(const std::filesystem::path& path);

}  // namespace vitrine
