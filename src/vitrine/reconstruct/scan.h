// reconstruct/scan.h: from RGB-D frames to one surface, the cameras that saw it and the plane that
// carries the objects. Knows nothing of glass or metal: where depth lies, the mesh lies too.
#pragma once

#include "capture/capture.h"
#include "geometry/mesh.h"
#include "geometry/plane.h"

#include <span>
#include <string>
#include <vector>

namespace vitrine {

enum class PoseMode {
    Refine,  ///< start from the capture's poses and improve them if the frames say so clearly
    Keep,    ///< take the capture's poses as they are
    Track,   ///< ignore them and find the poses from the frames
};

struct ScanOptions {
    PoseMode poses = PoseMode::Refine;
    double voxel_m = 0.003;          ///< of the fused volume; half the smallest detail that matters
    double truncation_m = 0.012;     ///< four voxels: spans the depth noise of one view
    double max_depth_m = 2.0;        ///< farther depth has noise above half the truncation
    double min_component_m2 = 1e-3;  ///< smaller floating pieces of surface are dropped
};

/// What happened to one frame's pose.
struct FramePose {
    std::string id;
    double moved_m = 0.0;        ///< distance from the pose that came in
    double turned_rad = 0.0;     ///< rotation from the pose that came in
    double residual_m = 0.0;     ///< robust sd of depth against the fused surface
    double exposure_gain = 1.0;  ///< how much brighter the frame is than the others
};

struct Scan {
    Mesh mesh;                     ///< fused surface in the world; colours = median linear radiance
    std::vector<Camera> cameras;   ///< one per frame that has a pose, in the capture's order
    Plane support_plane;           ///< carries the objects; the normal points up, to the cameras
    std::vector<FramePose> poses;  ///< one per camera
    std::vector<std::string> dropped;  ///< ids of frames whose pose could not be found
    double depth_residual_m = 0.0;     ///< robust sd of measured depth against the mesh
    std::vector<std::string> notes;    ///< plain sentences for the report
};

/// Without poses: frames that do not connect to the others are dropped and named as long as enough
/// remain (at least 60 % and five).
/// Cost: about 0.4 s a 640x360 frame on two cores.
/// @throws InputError when there is no usable depth, or too few frames find their pose.
Scan make_scan(const Capture& capture, const ScanOptions& options = {},
               const Progress& progress = {});

/// Up in the world as the cameras have it: nobody films a table lying on the side. Unit vector.
Vec3 likely_up(std::span<const Camera> cameras);

/// The capture as the scan knows it: dropped frames left out, exposures evened out. What comes
/// after the scan works on this, frame by camera.
Capture frames_of_scan(Capture capture, const Scan& scan);

/// Standard deviation of a structured-light or time-of-flight depth reading at planar depth z
/// (Nguyen, Izadi, Lovell 2012, axial noise of a Kinect).
inline double depth_noise_m(double z) { return 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4); }

}  // namespace vitrine
