// Redwood and Open3D: numbered colour and depth pictures in two folders, millimetres, a trajectory
// in a .log file (camera to world).
#include "base/file.h"
#include "base/text.h"
#include "capture/capture_listing.h"

#include <algorithm>
#include <map>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

fs::path colour_folder(const fs::path& folder) {
    for (const char* name : {"color", "image", "rgb", "colour"}) {
        if (fs::is_directory(folder / name)) return folder / name;
    }
    return {};
}

fs::path first_existing(const fs::path& folder, std::initializer_list<const char*> names) {
    for (const char* name : names) {
        if (fs::exists(folder / name)) return folder / name;
    }
    return {};
}

/// The number at the start of a file's name ("000012-000000034.png"); -1 when there is none.
long long leading_number(const fs::path& path) {
    const std::string stem = path.stem().string();
    std::size_t end = 0;
    while (end < stem.size() && end < 18 && std::isdigit(static_cast<unsigned char>(stem[end]))) {
        ++end;
    }
    return end == 0 ? -1 : std::stoll(stem.substr(0, end));
}

/// Blocks of five lines: "index index frame", then the rows of a 4 x 4 matrix, camera to world.
std::map<long long, Rigid3> read_log(const fs::path& path) {
    const std::vector<std::string> words = split_whitespace(read_text_file(path));
    constexpr std::size_t kBlock = 3 + 16;
    if (words.empty() || words.size() % kBlock != 0) {
        throw InputError({path.string(), "blocks of three indices and a 4 x 4 matrix",
                          fmt::format("{} numbers", words.size()), "Is the file cut off?"});
    }
    std::map<long long, Rigid3> poses;
    for (std::size_t at = 0; at < words.size(); at += kBlock) {
        const std::string where = fmt::format("{}, pose {}", path.string(), at / kBlock);
        double v[kBlock];
        for (std::size_t i = 0; i < kBlock; ++i) {
            if (!parse_double(words[at + i], v[i]) || !std::isfinite(v[i])) {
                throw InputError({where, "a finite number", "\"" + words[at + i] + "\"", ""});
            }
        }
        Mat3 rotation;
        Vec3 translation;
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) rotation(r, c) = v[3 + 4 * r + c];
            translation[r] = v[3 + 4 * r + 3];
        }
        if (!is_rotation(rotation, 1e-3)) {
            throw InputError({where, "a rotation", "scale, shear or mirroring", ""});
        }
        const Rigid3 world_from_camera =
            Rigid3::from_quaternion(Eigen::Quaterniond(rotation), translation);
        poses[static_cast<long long>(v[0])] = world_from_camera.inverse();
    }
    return poses;
}

CameraIntrinsic intrinsic_of(const fs::path& folder, CaptureListing& listing) {
    const fs::path file = first_existing(folder, {"camera_intrinsic.json", "intrinsic.json",
                                                  "intrinsics.json", "camera_primesense.json"});
    if (!file.empty()) {
        listing.metadata.push_back(file);
        return read_camera_intrinsic(file);
    }
    listing.warnings.push_back(
        "no camera_intrinsic.json: the PrimeSense default of Redwood is taken (640 x 480, "
        "fx = fy = 525)");
    CameraIntrinsic intrinsic;
    intrinsic.camera = {"", 640, 480, 525, 525, 319.5, 239.5, {}};
    return intrinsic;
}

}  // namespace

bool is_redwood(const fs::path& folder) {
    // With depth.txt it is a TUM folder that lacks its rgb.txt: another unit, another pairing.
    return !colour_folder(folder).empty() && fs::is_directory(folder / "depth") &&
           !fs::exists(folder / "depth.txt");
}

CaptureListing list_redwood(const fs::path& folder) {
    CaptureListing listing = start_listing(folder, 1000.0);
    const CameraIntrinsic intrinsic = intrinsic_of(folder, listing);
    const std::vector<fs::path> colour = pictures_in(colour_folder(folder));
    const std::vector<fs::path> depth = pictures_in(folder / "depth");
    if (colour.empty()) {
        throw InputError({colour_folder(folder).string(), "at least one picture", "none", ""});
    }
    std::map<long long, fs::path> depth_of;
    for (const fs::path& path : depth) {
        const long long number = leading_number(path);
        if (number < 0 || !depth_of.emplace(number, path).second) {
            throw InputError({path.string(), "a name that starts with the frame's own number",
                              path.filename().string(), ""});
        }
    }
    for (const fs::path& path : colour) {
        const auto match = depth_of.find(leading_number(path));
        if (match == depth_of.end()) continue;
        ListedFrame frame;
        frame.id = path.stem().string();
        frame.timestamp_s = static_cast<double>(match->first);
        frame.colour_file = path;
        frame.depth_file = match->second;
        frame.intrinsic = intrinsic;
        listing.frames.push_back(std::move(frame));
    }
    require_most(listing.frames.size(), colour.size(), folder.string(),
                 "a depth picture of the same number for at least 80 % of the colour pictures",
                 "Pictures pair by the number that their names start with.");
    if (listing.frames.size() < colour.size()) {
        listing.warnings.push_back(
            fmt::format("{} of {} colour pictures have no depth of their number and are left out",
                        colour.size() - listing.frames.size(), colour.size()));
    }
    const fs::path log = first_existing(folder, {"trajectory.log", "scene/trajectory.log"});
    if (log.empty() || listing.config.poses == PoseSource::None) return listing;
    listing.metadata.push_back(log);
    const std::map<long long, Rigid3> poses = read_log(log);
    // Pose k belongs to the k-th picture; files may be numbered from one.
    const long long first = leading_number(colour.front());
    std::vector<ListedFrame> posed;
    for (ListedFrame& frame : listing.frames) {
        const auto pose = poses.find(static_cast<long long>(frame.timestamp_s) - first);
        if (pose == poses.end()) continue;
        frame.cam_from_world = pose->second;
        posed.push_back(std::move(frame));
    }
    require_most(posed.size(), listing.frames.size(), log.string(),
                 "a pose for at least 80 % of the frames",
                 "Set \"poses\": \"none\" in capture.json to track the camera instead.");
    if (posed.size() < listing.frames.size()) {
        listing.warnings.push_back(fmt::format("{} frames have no pose and are left out",
                                               listing.frames.size() - posed.size()));
    }
    listing.frames = std::move(posed);
    listing.has_poses = true;
    return listing;
}

}  // namespace vitrine
