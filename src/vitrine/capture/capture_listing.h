// capture/capture_listing.h: what a folder holds, before any picture is opened: one reader per
// data-set layout fills the same list, and one loader turns it into a `Capture`.
#pragma once

#include "capture/capture_config.h"
#include "capture/read_capture.h"

#include <string>
#include <vector>

namespace vitrine {

struct ListedFrame {
    std::string id;
    double timestamp_s = 0.0;
    std::filesystem::path colour_file, depth_file;
    CameraIntrinsic intrinsic;  ///< of the colour picture
    Rigid3 cam_from_world;      ///< translation in `CaptureListing::metres_per_unit`
    std::vector<Vec3> points;   ///< sparse points it sees, in the camera, in the same unit
};

/// A depth camera that is not the colour camera.
struct DepthCamera {
    CameraIntrinsic intrinsic;
    Rigid3 colour_from_depth;
};

struct CaptureListing {
    std::vector<ListedFrame> frames;
    CaptureConfig config;
    double depth_scale = 5000.0;
    bool has_poses = false;
    /// Length of the unit of the poses; not set: to be found from the sparse points and the depth.
    std::optional<double> metres_per_unit = 1.0;
    std::optional<DepthCamera> depth_camera;
    /// Depth pictures of another size are pictures of the colour camera, only coarser or finer.
    bool allows_scaled_depth = false;
    std::vector<std::filesystem::path> metadata;  ///< files other than pictures that were read
    std::vector<std::string> warnings;
};

CaptureListing list_tum(const std::filesystem::path& folder);
CaptureListing list_redwood(const std::filesystem::path& folder);
CaptureListing list_nerfstudio(const std::filesystem::path& folder);
CaptureListing list_colmap(const std::filesystem::path& folder);
CaptureListing list_polycam(const std::filesystem::path& folder);
bool is_tum(const std::filesystem::path& folder);
bool is_redwood(const std::filesystem::path& folder);
bool is_nerfstudio(const std::filesystem::path& folder);
bool is_colmap(const std::filesystem::path& folder);
bool is_polycam(const std::filesystem::path& folder);

// Pieces that several readers need.

/// Reads capture.json if there is one, and a depth camera of its own if that is described.
/// @param default_depth_scale code per metre where capture.json says nothing
CaptureListing start_listing(const std::filesystem::path& folder, double default_depth_scale);

/// `name` beneath `folder`. @throws InputError when it is absolute or leads out of the folder.
std::filesystem::path path_inside(const std::filesystem::path& folder, const std::string& name,
                                  const std::string& where);

/// @throws InputError when fewer than 80 % of `all` have what they need.
void require_most(std::size_t having, std::size_t all, const std::string& where,
                  const std::string& expected, const std::string& hint);

/// The camera looks along -z with y up in `world_from_gl` (OpenGL); ours along +z with y down.
Rigid3 cam_from_world_of_gl(const Mat4& world_from_gl, const std::string& where);

/// Pictures (PNG, JPEG, EXR) directly in a folder, sorted by name.
std::vector<std::filesystem::path> pictures_in(const std::filesystem::path& folder);

/// A picture of the same stem in `folder`, PNG before others; empty when there is none.
std::filesystem::path picture_of_stem(const std::filesystem::path& folder, const std::string& stem);

}  // namespace vitrine
