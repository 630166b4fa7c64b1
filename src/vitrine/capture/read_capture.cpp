#include "base/text.h"
#include "capture/capture.h"
#include "capture/capture_config.h"
#include "capture/check.h"
#include "capture/trajectory.h"
#include "image/colour.h"
#include "image/image_io.h"

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

constexpr double kPairingTolerance_s = 0.02;  // interfaces.md 8
constexpr double kMinPairedShare = 0.8;
constexpr double kMaxDamagedShare = 0.05;

struct FramePair {
    double timestamp_s;
    std::string colour_file, depth_file;
};

std::vector<double> stamps_of(const std::vector<StampedFile>& list) {
    std::vector<double> stamps;
    for (const StampedFile& item : list) stamps.push_back(item.timestamp_s);
    return stamps;
}

std::vector<FramePair> pair_frames(const fs::path& folder, std::vector<std::string>& warnings) {
    const std::vector<StampedFile> colour = read_file_list(folder / "rgb.txt");
    const std::vector<StampedFile> depth = read_file_list(folder / "depth.txt");
    if (colour.empty()) {
        throw InputError({(folder / "rgb.txt").string(), "at least one frame", "none", ""});
    }
    const std::vector<int> match =
        associate(stamps_of(colour), stamps_of(depth), kPairingTolerance_s);
    std::vector<FramePair> pairs;
    for (std::size_t i = 0; i < colour.size(); ++i) {
        if (match[i] < 0) continue;
        pairs.push_back({colour[i].timestamp_s, colour[i].file,
                         depth[static_cast<std::size_t>(match[i])].file});
    }
    const std::size_t unpaired = colour.size() - pairs.size();
    if (static_cast<double>(pairs.size()) < kMinPairedShare * static_cast<double>(colour.size())) {
        throw InputError({(folder / "rgb.txt").string(),
                          "a depth picture within 20 ms for at least 80 % of the colour pictures",
                          fmt::format("{} of {}", pairs.size(), colour.size()),
                          "Are rgb.txt and depth.txt of the same recording and clock?"});
    }
    if (unpaired > 0) {
        warnings.push_back(
            fmt::format("{} of {} colour pictures have no depth within 20 ms and are "
                        "left out",
                        unpaired, colour.size()));
    }
    return pairs;
}

ImageRgb read_colour(const fs::path& path, const CaptureConfig& config, double exposure,
                     bool& is_hdr) {
    is_hdr = path.extension() == ".exr";
    ImageRgb image = is_hdr ? read_exr_rgb(path) : read_encoded_rgb(path);
    const auto black = static_cast<float>(config.black_level);
    const auto gain = static_cast<float>(config.linear_scale / exposure);
    for (Rgb& pixel : image) {
        if (!is_hdr) {
            pixel = ((pixel - black) / (1.0f - black)).max(0.0f);
            if (config.colour_space == ColourSpace::Srgb) {
                for (int c = 0; c < 3; ++c) pixel[c] = srgb_to_linear(pixel[c]);
            }
        }
        pixel *= gain;
        if (!pixel.allFinite()) pixel = Rgb::Zero();
    }
    return image;
}

ImageF read_depth(const fs::path& path, double depth_scale) {
    const Image<std::uint16_t> codes = read_png16(path);
    ImageF depth(codes.width(), codes.height());
    for (std::size_t i = 0; i < codes.size(); ++i) {
        depth[i] = static_cast<float>(codes[i] / depth_scale);
    }
    return depth;
}

/// Resamples to the ideal pinhole: colour bilinear, depth nearest (no mixing over edges).
void remove_distortion(RgbdFrame& frame, const CameraIntrinsic& intrinsic) {
    const Camera& camera = intrinsic.camera;
    ImageRgb colour(camera.width, camera.height);
    ImageF depth(camera.width, camera.height, 0.0f);
    for (int v = 0; v < camera.height; ++v) {
        for (int u = 0; u < camera.width; ++u) {
            const Vec2 ideal((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
            const Vec2 bent = intrinsic.distortion.distort(ideal);
            const double x = bent.x() * camera.fx + camera.cx, y = bent.y() * camera.fy + camera.cy;
            colour(u, v) = bilinear(frame.colour, x, y);
            const int xi = static_cast<int>(std::lround(x)), yi = static_cast<int>(std::lround(y));
            if (frame.depth_m.contains(xi, yi)) depth(u, v) = frame.depth_m(xi, yi);
        }
    }
    frame.colour = std::move(colour);
    frame.depth_m = std::move(depth);
}

void check_size(const fs::path& file, int width, int height, const Camera& camera) {
    if (width == camera.width && height == camera.height) return;
    throw InputError(
        {file.string(),
         fmt::format("{} x {} pixels as camera_intrinsic.json says", camera.width, camera.height),
         fmt::format("{} x {}", width, height),
         "Colour and depth must be registered to one camera."});
}

void set_poses(Capture& capture, const fs::path& folder, const CaptureConfig& config) {
    const fs::path file = folder / "groundtruth.txt";
    const bool wants_poses =
        config.poses.value_or(fs::exists(file) ? PoseSource::Trajectory : PoseSource::None) ==
        PoseSource::Trajectory;
    if (!wants_poses) return;
    const std::vector<StampedPose> poses = read_trajectory(file);
    std::vector<double> pose_stamps, stamps;
    for (const StampedPose& pose : poses) pose_stamps.push_back(pose.timestamp_s);
    for (const RgbdFrame& frame : capture.frames) stamps.push_back(frame.timestamp_s);
    const std::vector<int> match = associate(stamps, pose_stamps, kPairingTolerance_s);
    std::vector<RgbdFrame> posed;
    for (std::size_t i = 0; i < capture.frames.size(); ++i) {
        if (match[i] < 0) continue;
        RgbdFrame& frame = capture.frames[i];
        frame.camera.cam_from_world =
            poses[static_cast<std::size_t>(match[i])].world_from_camera.inverse();
        posed.push_back(std::move(frame));
    }
    if (static_cast<double>(posed.size()) < kMinPairedShare * static_cast<double>(stamps.size())) {
        throw InputError({file.string(), "a pose within 20 ms for at least 80 % of the frames",
                          fmt::format("{} of {}", posed.size(), stamps.size()),
                          "Set \"poses\": \"none\" in capture.json to track the camera instead."});
    }
    if (posed.size() < stamps.size()) {
        capture.warnings.push_back(
            fmt::format("{} frames have no pose and are left out", stamps.size() - posed.size()));
    }
    capture.frames = std::move(posed);
    capture.has_poses = true;
}

}  // namespace

Capture read_capture(const fs::path& folder, const Progress& progress) {
    if (!fs::is_directory(folder)) {
        throw InputError({folder.string(), "a capture folder", "no such folder", ""});
    }
    if (!fs::exists(folder / "rgb.txt")) {
        throw InputError({folder.string(), "rgb.txt, depth.txt and camera_intrinsic.json",
                          fs::is_empty(folder) ? "an empty folder" : "no rgb.txt",
                          "A capture follows the TUM RGB-D layout; see docs/conventions.md."});
    }
    Capture capture;
    capture.name = fs::absolute(folder).lexically_normal().filename().string();
    CaptureConfig config;
    if (fs::exists(folder / "capture.json")) config = read_capture_config(folder / "capture.json");
    const CameraIntrinsic intrinsic = read_camera_intrinsic(folder / "camera_intrinsic.json");
    const std::vector<FramePair> pairs = pair_frames(folder, capture.warnings);
    const auto allowed_damage = static_cast<std::size_t>(
        std::max(1.0, std::floor(kMaxDamagedShare * static_cast<double>(pairs.size()))));
    std::size_t damaged = 0;
    bool is_hdr = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        progress.update(static_cast<double>(i) / static_cast<double>(pairs.size()), "reading");
        const FramePair& pair = pairs[i];
        RgbdFrame frame;
        frame.id = fs::path(pair.colour_file).stem().string();
        frame.timestamp_s = pair.timestamp_s;
        const auto exposure = config.exposure.find(frame.id);
        if (exposure != config.exposure.end()) frame.exposure = exposure->second;
        try {
            frame.colour = read_colour(folder / pair.colour_file, config, frame.exposure, is_hdr);
            frame.depth_m = read_depth(folder / pair.depth_file, config.depth_scale);
        } catch (const InputError& error) {
            if (++damaged > allowed_damage) throw;
            capture.warnings.push_back(std::string("frame left out: ") + error.what());
            continue;
        }
        check_size(folder / pair.colour_file, frame.colour.width(), frame.colour.height(),
                   intrinsic.camera);
        check_size(folder / pair.depth_file, frame.depth_m.width(), frame.depth_m.height(),
                   intrinsic.camera);
        frame.camera = intrinsic.camera;
        frame.camera.id = frame.id;
        if (!intrinsic.distortion.is_none()) remove_distortion(frame, intrinsic);
        capture.frames.push_back(std::move(frame));
    }
    capture.saturation_level = is_hdr ? 1e30 : config.linear_scale;
    set_poses(capture, folder, config);
    capture.reference_albedo = config.reference_albedo;
    require_usable(capture, folder, config.depth_scale);
    progress.update(1.0, "reading");
    return capture;
}

}  // namespace vitrine
