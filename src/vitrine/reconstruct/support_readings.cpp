#include "reconstruct/support_readings.h"

#include "image/filter.h"
#include "math/statistics.h"
#include "reconstruct/mask_regions.h"
#include "reconstruct/scan.h"

#include <algorithm>

namespace vitrine {
namespace {

constexpr double kMaxDepth_m = 4.0;
constexpr double kMinHeight_m = 0.006;  // above the plane, at least three times the depth noise
constexpr double kMaxStep_m = 0.012;    // of depth between neighbours on one surface
constexpr double kSmallGap_m = 0.004;
constexpr double kSensorBaseline_m = 0.075;  // Kinect; others have less
constexpr double kShadowSlack_px = 4.0;

ImageF depth_of_plane(const Camera& camera, const Plane& support) {
    ImageF depth(camera.width, camera.height, 0.0f);
    const Vec3 eye = camera.centre_in_world();
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const Vec3 ray =
                camera.cam_from_world.rotation.transpose() * camera.ray_in_camera(x, y);
            const double fall = -ray.dot(support.normal);
            if (fall > 1e-6) depth(x, y) = static_cast<float>(support.height(eye) / fall);
        }
    }
    return depth;
}

/// Readings that no broad bridge of continuous depth connects to at least `max_pixels` others.
Mask islands(const ImageF& depth_m, int bridge_px, double max_pixels) {
    Mask readings(depth_m.width(), depth_m.height()), continuous = readings;
    for (int y = 0; y < depth_m.height(); ++y) {
        for (int x = 0; x < depth_m.width(); ++x) {
            const double z = depth_m(x, y);
            if (z <= 0) continue;
            readings(x, y) = 255;
            const double step = kMaxStep_m + 2 * depth_noise_m(z);
            const bool is_smooth = std::abs(depth_m.clamped(x + 1, y) - z) < step &&
                                   std::abs(depth_m.clamped(x, y + 1) - z) < step;
            if (is_smooth) continuous(x, y) = 255;
        }
    }
    const Mask cores = without_small_regions(erode(continuous, bridge_px), max_pixels);
    return mask_minus(readings, dilate(cores, bridge_px + 1));
}

}  // namespace

SupportReadings read_support(const ImageF& depth_m, const Camera& camera, const Plane& support,
                             double min_thickness_m, double max_island_m) {
    SupportReadings result;
    std::vector<double> depths;
    for (std::size_t i = 0; i < depth_m.size(); i += 7) {
        if (depth_m[i] > 0) depths.push_back(depth_m[i]);
    }
    if (depths.empty()) return result;
    result.pixels_per_m = camera.fx / median(std::move(depths));
    const auto pixels = [&](double m) {
        return std::max(1, static_cast<int>(std::lround(m * result.pixels_per_m)));
    };
    result.plane_depth_m = depth_of_plane(camera, support);
    result.classes = classify_depth(depth_m, result.plane_depth_m, camera, kMaxDepth_m);
    const int thick = pixels(0.5 * min_thickness_m), gap = pixels(kSmallGap_m);
    const Mask hanging = islands(depth_m, gap, std::pow(max_island_m * result.pixels_per_m, 2));
    result.on_plane = Mask(camera.width, camera.height);
    Mask above = result.on_plane, missing = result.on_plane;
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const double z = depth_m(x, y);
            if (result.classes(x, y) == DepthClass::Zero || is_inside(hanging, x, y)) {
                missing(x, y) = 255;
            } else if (z > 0) {
                const double height = support.height(camera.unproject(x, y, z));
                const double noise = std::max(kMinHeight_m, 3 * depth_noise_m(z));
                if (std::abs(height) < noise) result.on_plane(x, y) = 255;
                if (height >= noise) above(x, y) = 255;
            }
        }
    }
    // Speckles and lines where a wall cuts the plane are thin.
    result.surface = convex_hull(erode(result.on_plane, gap));
    const double smallest = std::pow(pixels(0.02), 2);
    result.solid = without_small_regions(dilate(erode(above, gap), gap), smallest);
    const Mask closed = erode(dilate(missing, gap), gap);
    result.missing = mask_and(dilate(erode(closed, thick), thick), result.surface);
    return result;
}

double shadow_width_px(const Camera& camera, double base_depth_m, double plane_depth_m) {
    if (base_depth_m <= 0 || plane_depth_m <= 0) return kShadowSlack_px;
    return kSensorBaseline_m * camera.fx * std::abs(1 / base_depth_m - 1 / plane_depth_m) +
           kShadowSlack_px;
}

}  // namespace vitrine
