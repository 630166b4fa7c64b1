// The TUM RGB-D layout: lists of stamped pictures, a stamped trajectory, one camera.
#include "capture/capture_listing.h"
#include "capture/trajectory.h"

namespace vitrine {
namespace fs = std::filesystem;
namespace {

constexpr double kPairingTolerance_s = 0.02;  // interfaces.md 8

template <typename Item>
std::vector<double> stamps_of(const std::vector<Item>& list) {
    std::vector<double> stamps;
    for (const Item& item : list) stamps.push_back(item.timestamp_s);
    return stamps;
}

void pair_frames(const fs::path& folder, CaptureListing& listing) {
    const fs::path list_file = folder / "rgb.txt";
    const std::vector<StampedFile> colour = read_file_list(list_file);
    const std::vector<StampedFile> depth = read_file_list(folder / "depth.txt");
    if (colour.empty()) throw InputError({list_file.string(), "at least one frame", "none", ""});
    const CameraIntrinsic intrinsic = read_camera_intrinsic(folder / "camera_intrinsic.json");
    const std::vector<int> match =
        associate(stamps_of(colour), stamps_of(depth), kPairingTolerance_s);
    for (std::size_t i = 0; i < colour.size(); ++i) {
        if (match[i] < 0) continue;
        ListedFrame frame;
        frame.id = fs::path(colour[i].file).stem().string();
        frame.timestamp_s = colour[i].timestamp_s;
        frame.colour_file = path_inside(folder, colour[i].file, list_file.string());
        frame.depth_file = path_inside(folder, depth[static_cast<std::size_t>(match[i])].file,
                                       (folder / "depth.txt").string());
        frame.intrinsic = intrinsic;
        listing.frames.push_back(std::move(frame));
    }
    require_most(listing.frames.size(), colour.size(), list_file.string(),
                 "a depth picture within 20 ms for at least 80 % of the colour pictures",
                 "Are rgb.txt and depth.txt of the same recording and clock?");
    if (listing.frames.size() < colour.size()) {
        listing.warnings.push_back(
            fmt::format("{} of {} colour pictures have no depth within 20 ms and are left out",
                        colour.size() - listing.frames.size(), colour.size()));
    }
}

void set_poses(const fs::path& file, CaptureListing& listing) {
    const std::vector<StampedPose> poses = read_trajectory(file);
    const std::vector<int> match =
        associate(stamps_of(listing.frames), stamps_of(poses), kPairingTolerance_s);
    std::vector<ListedFrame> posed;
    for (std::size_t i = 0; i < listing.frames.size(); ++i) {
        if (match[i] < 0) continue;
        listing.frames[i].cam_from_world =
            poses[static_cast<std::size_t>(match[i])].world_from_camera.inverse();
        posed.push_back(std::move(listing.frames[i]));
    }
    const std::size_t count = listing.frames.size();
    require_most(posed.size(), count, file.string(),
                 "a pose within 20 ms for at least 80 % of the frames",
                 "Set \"poses\": \"none\" in capture.json to track the camera instead.");
    if (posed.size() < count) {
        listing.warnings.push_back(
            fmt::format("{} frames have no pose and are left out", count - posed.size()));
    }
    listing.frames = std::move(posed);
    listing.has_poses = true;
}

}  // namespace

bool is_tum(const fs::path& folder) { return fs::exists(folder / "rgb.txt"); }

CaptureListing list_tum(const fs::path& folder) {
    CaptureListing listing = start_listing(folder, 5000.0);
    for (const char* name : {"rgb.txt", "depth.txt", "camera_intrinsic.json"}) {
        listing.metadata.push_back(folder / name);
    }
    pair_frames(folder, listing);
    const fs::path trajectory = folder / "groundtruth.txt";
    const bool wants_poses = listing.config.poses ? *listing.config.poses == PoseSource::Trajectory
                                                  : fs::exists(trajectory);
    if (wants_poses) {
        set_poses(trajectory, listing);
        listing.metadata.push_back(trajectory);
    }
    return listing;
}

}  // namespace vitrine
