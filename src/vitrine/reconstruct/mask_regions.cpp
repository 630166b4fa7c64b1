#include "reconstruct/mask_regions.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

constexpr double kMinPinchDepth = 0.08;  // of a contour's dent, in square roots of the area
constexpr double kMaxPinchLength = 1.1;  // of the cut, in square roots of the smaller part's area

cv::Mat view_of(Mask& mask) { return {mask.height(), mask.width(), CV_8U, mask.data()}; }

using Contour = std::vector<cv::Point>;

std::vector<Contour> outer_contours(Mask mask) {
    std::vector<Contour> contours;
    cv::findContours(view_of(mask), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    return contours;
}

Contour longest_contour(const Mask& mask) {
    const std::vector<Contour> contours = outer_contours(mask);
    if (contours.empty()) return {};
    return *std::max_element(contours.begin(), contours.end(),
                             [](const auto& a, const auto& b) { return a.size() < b.size(); });
}

}  // namespace

std::vector<Region> regions_of(const Mask& given, double min_pixels) {
    Mask mask = given;
    cv::Mat labels, stats, centres;
    const int count = cv::connectedComponentsWithStats(view_of(mask), labels, stats, centres, 4);
    std::vector<Region> regions;
    for (int k = 1; k < count; ++k) {
        const double pixels = stats.at<int>(k, cv::CC_STAT_AREA);
        if (pixels < min_pixels) continue;
        Region region{Mask(mask.width(), mask.height()), pixels, false};
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

Mask without_small_regions(const Mask& given, double min_pixels) {
    Mask mask = given;
    cv::Mat labels, stats, centres;
    cv::connectedComponentsWithStats(view_of(mask), labels, stats, centres, 4);
    for (int y = 0; y < mask.height(); ++y) {
        for (int x = 0; x < mask.width(); ++x) {
            const int k = labels.at<int>(y, x);
            if (k > 0 && stats.at<int>(k, cv::CC_STAT_AREA) < min_pixels) mask(x, y) = 0;
        }
    }
    return mask;
}

Mask fill_holes(const Mask& mask) {
    Mask filled(mask.width(), mask.height());
    cv::drawContours(view_of(filled), outer_contours(mask), -1, cv::Scalar(255), cv::FILLED);
    return filled;
}

Mask convex_hull(const Mask& mask) {
    Contour points, hull;
    for (int y = 0; y < mask.height(); ++y) {
        int first = -1, last = -1;
        for (int x = 0; x < mask.width(); ++x) {
            if (mask(x, y) < 128) continue;
            if (first < 0) first = x;
            last = x;
        }
        if (first >= 0) points.insert(points.end(), {{first, y}, {last, y}});
    }
    Mask filled(mask.width(), mask.height());
    if (points.size() < 3) return filled;
    cv::convexHull(points, hull);
    cv::fillConvexPoly(view_of(filled), hull, cv::Scalar(255));
    return filled;
}

Mask mask_and(const Mask& a, const Mask& b) {
    Mask both(a.width(), a.height());
    for (std::size_t i = 0; i < a.size(); ++i) both[i] = a[i] > 127 && b[i] > 127 ? 255 : 0;
    return both;
}

Mask mask_minus(const Mask& a, const Mask& b) {
    Mask rest(a.width(), a.height());
    for (std::size_t i = 0; i < a.size(); ++i) rest[i] = a[i] > 127 && b[i] < 128 ? 255 : 0;
    return rest;
}

std::vector<Region> cut_at_waist(const Region& region) {
    const Contour contour = longest_contour(region.mask);
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

}  // namespace vitrine
