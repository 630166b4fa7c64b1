#include "capture/read_capture.h"

#include "base/log.h"
#include "capture/capture_listing.h"
#include "capture/check.h"
#include "capture/register_depth.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "math/statistics.h"

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

constexpr double kMaxDamagedShare = 0.05;
constexpr std::size_t kMinScalePoints = 30;
constexpr double kMaxScaleSpread = 0.1;  // of the ratios of depth to sparse points, robust

struct ColourPicture {
    ImageRgb linear;
    bool is_hdr = false;
    std::size_t not_finite = 0;
};

ColourPicture read_colour(const fs::path& path, const CaptureConfig& config, double exposure) {
    ColourPicture picture;
    picture.is_hdr = path.extension() == ".exr";
    picture.linear = picture.is_hdr ? read_exr_rgb(path) : read_encoded_rgb(path);
    const auto black = static_cast<float>(config.black_level);
    const auto gain = static_cast<float>(config.linear_scale / exposure);
    for (Rgb& pixel : picture.linear) {
        if (!picture.is_hdr) {
            pixel = ((pixel - black) / (1.0f - black)).max(0.0f);
            if (config.colour_space == ColourSpace::Srgb) {
                for (int c = 0; c < 3; ++c) pixel[c] = srgb_to_linear(pixel[c]);
            }
        }
        pixel *= gain;
        if (!pixel.allFinite()) {
            pixel = Rgb::Zero();
            ++picture.not_finite;
        }
    }
    return picture;
}

ImageF read_depth(const fs::path& path, double depth_scale) {
    const Image<std::uint16_t> codes = read_png16(path);
    ImageF depth(codes.width(), codes.height());
    for (std::size_t i = 0; i < codes.size(); ++i) {
        depth[i] = static_cast<float>(codes[i] / depth_scale);
    }
    return depth;
}

/// Where a pixel of the ideal pinhole lies in the picture.
Vec2 bent_pixel(const CameraIntrinsic& intrinsic, int u, int v) {
    const Camera& c = intrinsic.camera;
    const Vec2 bent = intrinsic.distortion.distort({(u - c.cx) / c.fx, (v - c.cy) / c.fy});
    return {bent.x() * c.fx + c.cx, bent.y() * c.fy + c.cy};
}

ImageRgb undistorted(const ImageRgb& colour, const CameraIntrinsic& intrinsic) {
    ImageRgb ideal(colour.width(), colour.height());
    for (int v = 0; v < colour.height(); ++v) {
        for (int u = 0; u < colour.width(); ++u) {
            const Vec2 at = bent_pixel(intrinsic, u, v);
            ideal(u, v) = bilinear(colour, at.x(), at.y());
        }
    }
    return ideal;
}

/// Nearest reading: no mixing over edges.
ImageF undistorted(const ImageF& depth, const CameraIntrinsic& intrinsic) {
    ImageF ideal(depth.width(), depth.height(), 0.0f);
    for (int v = 0; v < depth.height(); ++v) {
        for (int u = 0; u < depth.width(); ++u) {
            const Vec2 at = bent_pixel(intrinsic, u, v);
            const int x = static_cast<int>(std::lround(at.x()));
            const int y = static_cast<int>(std::lround(at.y()));
            if (depth.contains(x, y)) ideal(u, v) = depth(x, y);
        }
    }
    return ideal;
}

void check_size(const fs::path& file, int width, int height, const Camera& camera,
                const std::string& described_by, const std::string& hint) {
    if (width == camera.width && height == camera.height) return;
    throw InputError(
        {file.string(),
         fmt::format("{} x {} pixels as {}", camera.width, camera.height, described_by),
         fmt::format("{} x {}", width, height), hint});
}

/// The intrinsics of a picture of the same camera with another number of pixels.
std::optional<CameraIntrinsic> scaled_intrinsic(const CameraIntrinsic& intrinsic, int width,
                                                int height) {
    const double across = double(width) / intrinsic.camera.width;
    const double down = double(height) / intrinsic.camera.height;
    if (std::abs(across / down - 1) > 0.02) return std::nullopt;
    CameraIntrinsic scaled = intrinsic;
    Camera& c = scaled.camera;
    c.width = width;
    c.height = height;
    c.fx *= across;
    c.fy *= down;
    c.cx = (c.cx + 0.5) * across - 0.5;  // corners coincide, not centres of corner pixels
    c.cy = (c.cy + 0.5) * down - 0.5;
    return scaled;
}

/// Depth in the ideal pixels of the colour camera, whatever camera took it.
ImageF bring_to_colour(const ImageF& depth, const ListedFrame& listed,
                       const CaptureListing& listing) {
    const Camera& colour = listed.intrinsic.camera;
    if (listing.depth_camera) {
        check_size(listed.depth_file, depth.width(), depth.height(),
                   listing.depth_camera->intrinsic.camera, "depth_camera_intrinsic.json says", "");
        return register_depth(depth, *listing.depth_camera, colour);
    }
    if (depth.width() == colour.width && depth.height() == colour.height) {
        return listed.intrinsic.distortion.is_none() ? depth : undistorted(depth, listed.intrinsic);
    }
    if (listing.allows_scaled_depth) {
        if (const auto own = scaled_intrinsic(listed.intrinsic, depth.width(), depth.height())) {
            return register_depth(depth, {*own, Rigid3()}, colour);
        }
    }
    check_size(listed.depth_file, depth.width(), depth.height(), colour,
               "the camera's intrinsics say",
               "Colour and depth must be registered to one camera, or depth needs "
               "depth_camera_intrinsic.json and \"colour_from_depth\" in capture.json.");
    return {};
}

std::string size_hint(const Camera& camera, int width, int height) {
    const double across = double(width) / camera.width, down = double(height) / camera.height;
    if (std::abs(across / down - 1) > 0.01) return "Are they of this camera?";
    return fmt::format(
        "The intrinsics are of pictures of another size: multiply fx, fy, cx and cy by {:.4g}.",
        across);
}

struct Pictures {
    ColourPicture colour;
    ImageF depth_m;
};

double exposure_of(const ListedFrame& listed, const CaptureConfig& config) {
    const auto found = config.exposure.find(listed.id);
    return found == config.exposure.end() ? 1.0 : found->second;
}

RgbdFrame make_frame(const ListedFrame& listed, const CaptureListing& listing, Pictures pictures) {
    const Camera& camera = listed.intrinsic.camera;
    ImageRgb& colour = pictures.colour.linear;
    check_size(listed.colour_file, colour.width(), colour.height(), camera,
               "the camera's intrinsics say", size_hint(camera, colour.width(), colour.height()));
    RgbdFrame frame;
    frame.id = listed.id;
    frame.timestamp_s = listed.timestamp_s;
    frame.exposure = exposure_of(listed, listing.config);
    frame.colour = listed.intrinsic.distortion.is_none() ? std::move(colour)
                                                         : undistorted(colour, listed.intrinsic);
    frame.depth_m = bring_to_colour(pictures.depth_m, listed, listing);
    frame.camera = camera;
    frame.camera.id = frame.id;
    if (listing.has_poses) frame.camera.cam_from_world = listed.cam_from_world;
    return frame;
}

/// Keeps every k-th frame so that the pictures fit into memory.
void thin_out(std::size_t max_bytes, CaptureListing& listing) {
    std::size_t bytes = 0;
    for (const ListedFrame& frame : listing.frames) {
        const Camera& c = frame.intrinsic.camera;
        bytes += static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height) *
                 (sizeof(Rgb) + sizeof(float));
    }
    const std::size_t step = (bytes + max_bytes - 1) / max_bytes;
    if (step <= 1) return;
    std::vector<ListedFrame> kept;
    for (std::size_t i = 0; i < listing.frames.size(); i += step) {
        kept.push_back(std::move(listing.frames[i]));
    }
    listing.warnings.push_back(
        fmt::format("{} of {} frames are used (every {}th): all would need {:.1f} GB", kept.size(),
                    listing.frames.size(), step, 1e-9 * static_cast<double>(bytes)));
    listing.frames = std::move(kept);
}

/// The unit of poses that have one of their own: measured depth over the depth of sparse points.
void set_scale(const CaptureListing& listing, const std::vector<std::size_t>& origin,
               const fs::path& folder, Capture& capture) {
    double scale = listing.metres_per_unit.value_or(0.0);
    if (!listing.metres_per_unit) {
        std::vector<double> ratios;
        for (std::size_t i = 0; i < capture.frames.size(); ++i) {
            const RgbdFrame& frame = capture.frames[i];
            for (const Vec3& p : listing.frames[origin[i]].points) {
                const Vec2 pixel = frame.camera.project_camera(p);
                if (!frame.camera.sees(pixel)) continue;
                const float z = frame.depth_m(static_cast<int>(std::lround(pixel.x())),
                                              static_cast<int>(std::lround(pixel.y())));
                if (z > 0) ratios.push_back(z / p.z());
            }
        }
        scale = ratios.empty() ? 0.0 : median(ratios);
        const double spread = scale > 0 ? robust_sd(ratios) / scale : 0.0;
        if (ratios.size() < kMinScalePoints || spread > kMaxScaleSpread) {
            throw InputError({folder.string(), "the unit of the poses",
                              fmt::format("{} sparse points with depth that differ by {:.0f} %",
                                          ratios.size(), 100 * spread),
                              "Give \"metres_per_unit\" in capture.json."});
        }
        capture.warnings.push_back(
            fmt::format("the model's unit is {:.4g} m: {} sparse points against the depth, which "
                        "scatter by {:.1f} %",
                        scale, ratios.size(), 100 * spread));
    }
    for (RgbdFrame& frame : capture.frames) frame.camera.cam_from_world.translation *= scale;
}

}  // namespace

std::vector<fs::path> capture_files(const fs::path& folder) {
    const CaptureListing listing = find_capture_reader(folder).list(folder);
    std::vector<fs::path> files = listing.metadata;
    for (const ListedFrame& frame : listing.frames) {
        files.push_back(frame.colour_file);
        files.push_back(frame.depth_file);
    }
    return files;
}

Capture read_capture(const fs::path& folder, const Progress& progress) {
    return read_capture(folder, CaptureReadOptions(), progress);
}

Capture read_capture(const fs::path& folder, const CaptureReadOptions& options,
                     const Progress& progress) {
    const CaptureReader& reader = find_capture_reader(folder);
    Capture capture;
    capture.name = fs::absolute(folder).lexically_normal().filename().string();
    log_info("{}: {} layout", folder.string(), reader.name);
    CaptureListing listing = reader.list(folder);
    thin_out(options.max_bytes, listing);
    capture.warnings = listing.warnings;
    const std::size_t count = listing.frames.size();
    const auto allowed_damage = static_cast<std::size_t>(
        std::max(1.0, std::floor(kMaxDamagedShare * static_cast<double>(count))));
    std::size_t damaged = 0, not_finite = 0;
    bool is_hdr = false;
    double longest_exposure = 0;
    std::vector<std::size_t> origin;  // index in the listing of each frame that was read
    for (std::size_t i = 0; i < count; ++i) {
        progress.update(static_cast<double>(i) / static_cast<double>(count), "reading");
        const ListedFrame& listed = listing.frames[i];
        Pictures pictures;
        try {
            pictures.colour = read_colour(listed.colour_file, listing.config,
                                          exposure_of(listed, listing.config));
            pictures.depth_m = read_depth(listed.depth_file, listing.depth_scale);
        } catch (const InputError& error) {
            if (++damaged > allowed_damage) throw;
            capture.warnings.push_back(std::string("frame left out: ") + error.what());
            continue;
        }
        is_hdr = is_hdr || pictures.colour.is_hdr;
        not_finite += pictures.colour.not_finite;
        capture.frames.push_back(make_frame(listed, listing, std::move(pictures)));
        origin.push_back(i);
        longest_exposure = std::max(longest_exposure, capture.frames.back().exposure);
    }
    if (not_finite > 0) {
        capture.warnings.push_back(
            fmt::format("{} colour pixels are not a number and are taken as black", not_finite));
    }
    capture.saturation_level =
        is_hdr ? 1e30 : listing.config.linear_scale / std::max(longest_exposure, 1e-12);
    capture.has_poses = listing.has_poses;
    if (capture.has_poses) set_scale(listing, origin, folder, capture);
    capture.reference_albedo = listing.config.reference_albedo;
    require_usable(capture, folder, listing.depth_scale);
    progress.update(1.0, "reading");
    return capture;
}

}  // namespace vitrine
