#include "reconstruct/single_view.h"

#include "image/filter.h"
#include "math/statistics.h"
#include "reconstruct/depth_classes.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>

namespace vitrine {
namespace {

constexpr double kPlaneTolerance_m = 0.02;  // one reading of one view, on glossy tables
constexpr double kRimWidth_m = 0.015;
constexpr double kMinPinchDepth = 0.08;  // of a contour's dent, in square roots of the area
constexpr double kMaxPinchLength = 1.1;  // of the cut, in square roots of the smaller part's area
constexpr int kMaxCuts = 3;
constexpr double kMaxDepth_m = 4.0;
constexpr int kBoxMargin_px = 25;

cv::Mat view_of(Mask& mask) { return {mask.height(), mask.width(), CV_8U, mask.data()}; }

/// Connected regions of a mask, each as a mask of its own with its number of pixels.
struct Region {
    Mask mask;
    double pixels = 0;
    bool touches_border = false;
};

std::vector<Region> regions_of(Mask mask, double min_pixels) {
    cv::Mat labels, stats, centres;
    const int count = cv::connectedComponentsWithStats(view_of(mask), labels, stats, centres, 4);
    std::vector<Region> regions;
    for (int k = 1; k < count; ++k) {
        if (stats.at<int>(k, cv::CC_STAT_AREA) < min_pixels) continue;
        Region region{Mask(mask.width(), mask.height()), double(stats.at<int>(k, cv::CC_STAT_AREA)),
                      false};
        const int x = stats.at<int>(k, cv::CC_STAT_LEFT), y = stats.at<int>(k, cv::CC_STAT_TOP);
        const int w = stats.at<int>(k, cv::CC_STAT_WIDTH), h = stats.at<int>(k, cv::CC_STAT_HEIGHT);
        region.touches_border =
            x <= 1 || y <= 1 || x + w >= mask.width() - 1 || y + h >= mask.height() - 1;
        for (int v = y; v < y + h; ++v) {
            for (int u = x; u < x + w; ++u) {
                if (labels.at<int>(v, u) == k) region.mask(u, v) = 255;
            }
        }
        regions.push_back(std::move(region));
    }
    return regions;
}

std::vector<cv::Point> contour_of(Mask mask) {
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(view_of(mask), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    if (contours.empty()) return {};
    return *std::max_element(contours.begin(), contours.end(),
                             [](const auto& a, const auto& b) { return a.size() < b.size(); });
}

Mask convex_hull(const Mask& mask) {
    std::vector<cv::Point> hull;
    const std::vector<cv::Point> contour = contour_of(mask);
    Mask filled(mask.width(), mask.height());
    if (contour.size() < 3) return filled;
    cv::convexHull(contour, hull);
    cv::fillConvexPoly(view_of(filled), hull, cv::Scalar(255));
    return filled;
}

/// Cuts a region in two between the two deepest dents of its contour; empty when there is no waist.
std::vector<Region> cut_at_waist(const Region& region) {
    const std::vector<cv::Point> contour = contour_of(region.mask);
    if (contour.size() < 20) return {};
    std::vector<int> hull;
    cv::convexHull(contour, hull, false, false);
    std::sort(hull.begin(), hull.end(), std::greater<>());
    std::vector<cv::Vec4i> dents;  // start, end, deepest point, depth * 256
    cv::convexityDefects(contour, hull, dents);
    if (dents.size() < 2) return {};
    std::sort(dents.begin(), dents.end(),
              [](const cv::Vec4i& a, const cv::Vec4i& b) { return a[3] > b[3]; });
    const double size = std::sqrt(region.pixels);
    if (dents[1][3] / 256.0 < kMinPinchDepth * size) return {};
    const cv::Point a = contour[static_cast<std::size_t>(dents[0][2])];
    const cv::Point b = contour[static_cast<std::size_t>(dents[1][2])];
    Mask divided = region.mask;
    cv::line(view_of(divided), a, b, cv::Scalar(0), 2);
    std::vector<Region> parts = regions_of(divided, 0.1 * region.pixels);
    if (parts.size() != 2) return {};
    const double smaller = std::sqrt(std::min(parts[0].pixels, parts[1].pixels));
    if (std::hypot(a.x - b.x, a.y - b.y) > kMaxPinchLength * smaller) return {};
    return parts;
}

/// Pixels without a reading; small islands of readings inside count as well.
Mask without_depth(const ImageF& depth_m, double max_island_px) {
    Mask has_depth(depth_m.width(), depth_m.height());
    for (std::size_t i = 0; i < depth_m.size(); ++i) has_depth[i] = depth_m[i] > 0 ? 255 : 0;
    Mask bad = mask_not(has_depth);
    for (const Region& island : regions_of(has_depth, 1)) {
        if (island.touches_border || island.pixels > max_island_px * max_island_px) continue;
        bad = mask_or(bad, island.mask);
    }
    return bad;
}

/// What the readings around a region say.
struct Rim {
    double depth_m = 0.0;
    double on_plane = 0.0;  ///< share of the lower half's readings
};

Rim look_around(const RgbdFrame& frame, const Camera& camera, const Plane& support,
                const Mask& region, int width_px) {
    const Mask ring = dilate(region, width_px);
    const PixelBox box = PixelBox::of(region);
    std::vector<double> depths;
    double low = 0, on_plane = 0;
    for (int y = box.y0 - width_px; y < box.y1 + width_px; ++y) {
        for (int x = box.x0 - width_px; x < box.x1 + width_px; ++x) {
            if (!is_inside(ring, x, y) || is_inside(region, x, y)) continue;
            const double z = frame.depth_m(x, y);
            if (z <= 0) continue;
            depths.push_back(z);
            if (2 * y < box.y0 + box.y1) continue;
            low += 1;
            const double height = support.height(camera.unproject(x, y, z));
            on_plane += std::abs(height) < kPlaneTolerance_m ? 1 : 0;
        }
    }
    if (depths.empty() || low == 0) return {};
    return {median(std::move(depths)), on_plane / low};
}

DepthClasses classes_on_plane(const RgbdFrame& frame, const Camera& camera, const Plane& support) {
    ImageF model(camera.width, camera.height, 0.0f);
    const Vec3 eye = camera.centre_in_world();
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const Vec3 ray =
                camera.cam_from_world.rotation.transpose() * camera.ray_in_camera(x, y);
            const double fall = -ray.dot(support.normal);
            if (fall > 1e-6) model(x, y) = static_cast<float>(support.height(eye) / fall);
        }
    }
    return classify_depth(frame.depth_m, model, camera, kMaxDepth_m);
}

Mask cut_outline(const RgbdFrame& frame, const DepthClasses& classes, const Mask& start,
                 double saturation_level) {
    SilhouetteView view;
    view.colour = &frame.colour;
    view.classes = &classes;
    view.background = ImageRgb(start.width(), start.height());
    view.has_background = Mask(start.width(), start.height());
    view.hidden = Mask(start.width(), start.height());
    view.expected = start;
    view.box = PixelBox::of(start).grown(kBoxMargin_px, start.width(), start.height());
    for (const double slack : {10.0, 6.0}) {
        const Mask drawn =
            cut_silhouettes(std::span(&view, 1), saturation_level, {.outline_slack_px = slack})[0];
        // Highlights and clear middles leave gaps; glasses and bottles have none in one view.
        const Mask next = convex_hull(drawn);
        if (count_inside(next) < 30) return start;
        view.expected = next;
    }
    return view.expected;
}

}  // namespace

std::vector<Outline> find_outlines(const RgbdFrame& frame, const Camera& camera,
                                   const Plane& support, double saturation_level,
                                   const OutlineOptions& options) {
    std::vector<double> depths;
    for (std::size_t i = 0; i < frame.depth_m.size(); i += 7) {
        if (frame.depth_m[i] > 0) depths.push_back(frame.depth_m[i]);
    }
    std::vector<Outline> outlines;
    if (depths.empty()) return outlines;
    const double pixels_per_m = camera.fx / median(std::move(depths));
    const int opening = std::max(1, static_cast<int>(0.5 * options.min_thickness_m * pixels_per_m));
    const Mask bad = without_depth(frame.depth_m, options.max_island_m * pixels_per_m);
    const double min_side = options.min_size_m * pixels_per_m;
    std::vector<Region> regions =
        regions_of(dilate(erode(bad, opening), opening), min_side * min_side);
    std::erase_if(regions, [](const Region& region) { return region.touches_border; });
    for (std::size_t i = 0, cuts = 0; i < regions.size() && cuts < kMaxCuts * regions.size();) {
        std::vector<Region> parts = cut_at_waist(regions[i]);
        if (parts.empty()) {
            ++i;
            continue;
        }
        ++cuts;
        regions[i] = std::move(parts[0]);
        regions.push_back(std::move(parts[1]));
    }
    const DepthClasses classes = classes_on_plane(frame, camera, support);
    for (const Region& region : regions) {
        const int rim_px = std::max(3, static_cast<int>(kRimWidth_m * pixels_per_m));
        const Rim rim = look_around(frame, camera, support, region.mask, rim_px);
        const double size = std::sqrt(region.pixels) * rim.depth_m / camera.fx;
        if (size < options.min_size_m || size > options.max_size_m) continue;
        if (rim.on_plane < options.min_rim_on_plane) continue;
        Outline outline;
        outline.frame = frame.id;
        outline.silhouette =
            cut_outline(frame, classes, convex_hull(region.mask), saturation_level);
        outline.box = PixelBox::of(outline.silhouette);
        outline.evidence = fmt::format(
            "no depth over {:.0f} cm2 that stand on the support plane: glass, metal, or something "
            "dark; one view cannot tell",
            1e4 * size * size);
        outlines.push_back(std::move(outline));
    }
    return outlines;
}

}  // namespace vitrine
