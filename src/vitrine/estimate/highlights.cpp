#include "estimate/highlights.h"

#include "image/colour.h"
#include "image/filter.h"
#include "image/poisson.h"
#include "math/statistics.h"

#include <opencv2/imgproc.hpp>

#include <numeric>

namespace vitrine {
namespace {

double inradius(const Mask& mask) {
    float radius = 0;
    for (const float d : distance_to(mask_not(mask))) radius = std::max(radius, d);
    return std::min<double>(radius, std::max(mask.width(), mask.height()));
}

/// Luminance as the eye grades it, about 0 to 1. Pictures without clipping are scaled so that the
/// bright end of the object (95 %) shows 0.8: highlights may then exceed 1.
ImageF encoded_luminance(const ImageRgb& linear, const Mask& mask, double saturation_level) {
    double white = saturation_level;
    if (white > 1e6) {
        std::vector<double> values;
        for (std::size_t i = 0; i < mask.size(); ++i)
            if (mask[i] > 127) values.push_back(luminance(linear[i]));
        white = std::max(quantile(std::move(values), 0.95), 1e-9) / srgb_to_linear(0.8f);
    }
    ImageF result(linear.width(), linear.height());
    for (std::size_t i = 0; i < linear.size(); ++i)
        result[i] = linear_to_srgb(static_cast<float>(luminance(linear[i]) / white));
    return result;
}

/// Khan et al. 2006: from the last filled bin up to the mode of the bright end, then down to the
/// valley behind it. @returns 1e9 when the descent ends in the main body: no separate mode.
double histogram_threshold(const ImageF& y, const Mask& mask, const HighlightOptions& options) {
    const int bins = options.bins;
    std::vector<double> raw(static_cast<std::size_t>(bins), 0.0), smooth(raw);
    double inside = 0;
    for (std::size_t i = 0; i < y.size(); ++i) {
        if (mask[i] <= 127) continue;
        const int bin = std::clamp(static_cast<int>(y[i] * static_cast<float>(bins)), 0, bins - 1);
        raw[static_cast<std::size_t>(bin)] += 1;
        inside += 1;
    }
    const int reach = static_cast<int>(3 * options.bin_sigma);
    for (int b = 0; b < bins; ++b) {
        double sum = 0, weight = 0;
        for (int k = -reach; k <= reach; ++k) {
            if (b + k < 0 || b + k >= bins) continue;
            const double w = std::exp(-0.5 * k * k / (options.bin_sigma * options.bin_sigma));
            sum += w * raw[static_cast<std::size_t>(b + k)];
            weight += w;
        }
        smooth[static_cast<std::size_t>(b)] = sum / weight;
    }
    int b = bins - 1;
    while (b > 0 && raw[static_cast<std::size_t>(b)] == 0) --b;
    const auto at = [&](int k) { return smooth[static_cast<std::size_t>(k)]; };
    while (b > 0 && at(b - 1) >= at(b)) --b;
    const double mode = at(b);
    while (b > 0 && at(b - 1) <= at(b)) --b;
    const double valley = at(b);
    const double threshold = (b + 0.5) / bins;
    double above = 0;
    for (std::size_t i = 0; i < y.size(); ++i)
        if (mask[i] > 127 && y[i] > threshold) above += 1;
    const bool is_separate = valley < 0.7 * mode && above <= options.max_share * inside;
    return is_separate ? threshold : 1e9;
}

cv::Mat as_cv(ImageF& image) { return {image.height(), image.width(), CV_32FC1, image.data()}; }

/// y minus its blurred opening by a disc: what sticks out of its surroundings.
ImageF top_hat(const ImageF& y, const Mask& mask, double radius_px) {
    ImageF extended = extend_nearest(y, mask);
    constexpr double kWorkRadius = 12;  // disc radius at which the opening runs
    const double shrink = std::min(1.0, kWorkRadius / radius_px);
    cv::Mat small, opened, full;
    cv::resize(as_cv(extended), small, cv::Size(), shrink, shrink, cv::INTER_AREA);
    const int side = 2 * static_cast<int>(std::lround(radius_px * shrink)) + 1;
    const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(side, side));
    cv::morphologyEx(small, opened, cv::MORPH_OPEN, disc, cv::Point(-1, -1), 1,
                     cv::BORDER_REPLICATE);
    cv::GaussianBlur(opened, opened, cv::Size(), side / 6.0);
    cv::resize(opened, full, cv::Size(y.width(), y.height()), 0, 0, cv::INTER_LINEAR);
    ImageF result(y.width(), y.height());
    for (int row = 0; row < y.height(); ++row)
        for (int x = 0; x < y.width(); ++x) result(x, row) = y(x, row) - full.at<float>(row, x);
    return result;
}

/// Connected pieces (8 neighbours) of a mask, in order of their first pixel.
std::vector<std::vector<std::size_t>> pieces(const Mask& mask) {
    const cv::Mat input(mask.height(), mask.width(), CV_8UC1,
                        const_cast<std::uint8_t*>(mask.data()));
    cv::Mat labels;
    const int count = cv::connectedComponents(input, labels, 8);
    std::vector<std::vector<std::size_t>> result(static_cast<std::size_t>(count - 1));
    for (std::size_t i = 0; i < mask.size(); ++i) {
        const int label = labels.at<int>(static_cast<int>(i));
        if (label > 0) result[static_cast<std::size_t>(label - 1)].push_back(i);
    }
    return result;
}

/// Grows one blob outward while the median luminance of its rings keeps falling.
void grow(const std::vector<std::size_t>& blob, const ImageF& y, const Mask& mask,
          const Mask& other_cores, double inradius_px, Mask& grown) {
    const int width = y.width();
    const double blob_radius = std::sqrt(static_cast<double>(blob.size()) / kPi);
    const int reach =
        std::max(3, static_cast<int>(std::min(0.25 * inradius_px, 1.2 * blob_radius + 3)));
    int x0 = width, x1 = 0, y0 = y.height(), y1 = 0;
    for (const std::size_t i : blob) {
        const int px = static_cast<int>(i) % width, py = static_cast<int>(i) / width;
        x0 = std::min(x0, px);
        x1 = std::max(x1, px);
        y0 = std::min(y0, py);
        y1 = std::max(y1, py);
    }
    x0 = std::max(0, x0 - reach - 1);
    y0 = std::max(0, y0 - reach - 1);
    x1 = std::min(width - 1, x1 + reach + 1);
    y1 = std::min(y.height() - 1, y1 + reach + 1);
    Mask local(x1 - x0 + 1, y1 - y0 + 1);
    for (const std::size_t i : blob)
        local(static_cast<int>(i) % width - x0, static_cast<int>(i) / width - y0) = 255;
    const ImageF distance = distance_to(local);
    std::vector<std::vector<double>> rings(static_cast<std::size_t>(reach) + 1);
    for (int py = 0; py < local.height(); ++py) {
        for (int px = 0; px < local.width(); ++px) {
            const auto ring = static_cast<std::size_t>(std::ceil(distance(px, py)));
            if (ring >= rings.size() || !is_inside(mask, px + x0, py + y0)) continue;
            if (ring > 0 && is_inside(other_cores, px + x0, py + y0)) continue;
            rings[ring].push_back(y(px + x0, py + y0));
        }
    }
    double steepest = 0, last = rings[0].empty() ? 0 : quantile(rings[0], 0.25);
    int stop = 0;
    for (int ring = 1; ring <= reach; ++ring) {
        if (rings[static_cast<std::size_t>(ring)].empty()) break;
        const double middle = median(rings[static_cast<std::size_t>(ring)]);
        const double fall = last - middle;
        steepest = std::max(steepest, fall);
        last = middle;
        stop = ring;
        if (ring > 1 && fall < std::max(0.15 * steepest, 0.002)) break;
    }
    const double radius = stop + 0.02 * inradius_px;
    for (int py = 0; py < local.height(); ++py)
        for (int px = 0; px < local.width(); ++px)
            if (distance(px, py) <= radius && is_inside(mask, px + x0, py + y0))
                grown(px + x0, py + y0) = 255;
}

/// Where the picture clips, the highlight goes on as steep as it came in at the clipped border.
void extrapolate_clipped(const ImageRgb& linear, double saturation_level, const Mask& grown,
                         ImageRgb& residual) {
    Mask unclipped(linear.width(), linear.height());
    bool any = false;
    for (std::size_t i = 0; i < linear.size(); ++i) {
        const bool is_clipped =
            grown[i] > 127 && (linear[i] >= static_cast<float>(0.98 * saturation_level)).all();
        unclipped[i] = is_clipped ? 0 : 255;
        any = any || is_clipped;
    }
    if (!any) return;
    const ImageF depth = distance_to(unclipped);
    // The slope at the border: luminance of the residual lost over the first two pixels outside.
    const ImageF outside = distance_to(mask_not(unclipped));
    double near_sum = 0, far_sum = 0, near_count = 0, far_count = 0;
    for (std::size_t i = 0; i < linear.size(); ++i) {
        if (grown[i] <= 127 || depth[i] > 0) continue;
        const double value = luminance(residual[i]);
        if (outside[i] < 1.5f) {
            near_sum += value;
            near_count += 1;
        } else if (outside[i] >= 2.5f && outside[i] < 3.5f) {
            far_sum += value;
            far_count += 1;
        }
    }
    if (near_count == 0 || far_count == 0) return;
    const double slope = std::max(0.0, (near_sum / near_count - far_sum / far_count) / 2);
    for (std::size_t i = 0; i < linear.size(); ++i) {
        if (depth[i] <= 0) continue;
        residual[i] += Rgb::Constant(static_cast<float>(slope) * depth[i]);
    }
}

/// Colour of the lamp from the unclipped part of a blob; white where that says nothing.
Rgb blob_colour(const std::vector<std::size_t>& pixels, const ImageRgb& linear,
                const ImageRgb& difference, double saturation_level) {
    Rgbd sum = Rgbd::Zero();
    for (const std::size_t i : pixels) {
        if ((linear[i] >= static_cast<float>(0.95 * saturation_level)).any()) continue;
        sum += difference[i].max(0.0f).cast<double>();
    }
    const double largest = sum.maxCoeff();
    if (largest <= 0) return Rgb::Ones();
    const Rgbd colour = sum / largest;
    return colour.minCoeff() < 0.5 ? Rgb::Ones() : colour.cast<float>().eval();
}

}  // namespace

Highlights find_highlights(const ImageRgb& linear, const Mask& mask, double saturation_level,
                           const HighlightOptions& options) {
    VITRINE_CHECK(mask.same_size(linear));
    Highlights result;
    const int width = linear.width(), height = linear.height();
    const double radius = inradius(mask);
    const auto inside = static_cast<double>(count_inside(mask));
    const ImageF y = encoded_luminance(linear, mask, saturation_level);
    const ImageF excess = top_hat(y, mask, options.top_hat_radius * radius);
    const double threshold = histogram_threshold(y, mask, options);
    std::vector<double> values;
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i] > 127) values.push_back(y[i]);
    const double middle = median(values);
    // Noses and brows stick out of their surroundings too; a lamp outshines the whole object.
    const double bright = std::min(quantile(std::move(values), 0.9), 0.98 - 0.5 * options.top_hat);

    result.core = Mask(width, height);
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127) continue;
        const bool in_histogram = y[i] > threshold && excess[i] > 0.3 * options.top_hat;
        if (in_histogram || (excess[i] > options.top_hat && y[i] > std::max(middle, bright)))
            result.core[i] = 255;
    }
    result.core = dilate(erode(result.core, 1), 1);
    const ImageF rim = distance_to(mask_not(mask));
    std::vector<std::vector<std::size_t>> kept;
    for (std::vector<std::size_t>& blob : pieces(result.core)) {
        std::vector<double> rims;
        float peak = 0;
        for (const std::size_t i : blob) {
            rims.push_back(rim[i]);
            peak = std::max(peak, y[i]);
        }
        const auto size = static_cast<double>(blob.size());
        // Slivers along the contour are mixed pixels; specks are noise; vast areas are shading.
        const bool is_highlight = median(rims) > std::max(1.5, 0.02 * radius) &&
                                  size <= 0.05 * inside && size >= 0.0001 * inside &&
                                  peak > bright + 0.5 * options.top_hat;
        if (is_highlight) kept.push_back(std::move(blob));
    }
    result.core = Mask(width, height);
    double total = 0;
    for (const auto& blob : kept) {
        for (const std::size_t i : blob) result.core[i] = 255;
        total += static_cast<double>(blob.size());
    }
    if (total > options.max_share * inside) {
        kept.clear();
        total = 0;
        result.core = Mask(width, height);
    }
    result.share = total / inside;
    if (!kept.empty())
        result.method = threshold < 1e8 ? HighlightMethod::Histogram : HighlightMethod::TopHat;

    result.grown = Mask(width, height);
    for (const auto& blob : kept) grow(blob, y, mask, result.core, radius, result.grown);
    // The fill must not look at the background: it borrows the nearest object pixels there.
    result.diffuse = harmonic_fill(extend_nearest(linear, mask), result.grown);
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i] <= 127) result.diffuse[i] = linear[i];

    ImageRgb difference(width, height);
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (result.grown[i] > 127) difference[i] = linear[i] - result.diffuse[i];
    result.residual = ImageRgb(width, height);
    for (std::vector<std::size_t>& pixels : pieces(result.grown)) {
        HighlightBlob blob;
        blob.colour = blob_colour(pixels, linear, difference, saturation_level);
        for (const std::size_t i : pixels) {
            // Bright channels clip first: the channel least clipped tells how strong the lamp is.
            const float strength = std::max(0.0f, (difference[i] / blob.colour).maxCoeff());
            result.residual[i] = strength * blob.colour;
            const double weight = result.core[i] > 127 ? strength : 0.0;
            blob.weight += weight;
            blob.centroid_px +=
                weight * Vec2(static_cast<double>(i % static_cast<std::size_t>(width)),
                              static_cast<double>(i / static_cast<std::size_t>(width)));
        }
        if (blob.weight <= 0) continue;
        blob.centroid_px /= blob.weight;
        blob.pixels = std::move(pixels);
        result.blobs.push_back(std::move(blob));
    }
    std::stable_sort(
        result.blobs.begin(), result.blobs.end(),
        [](const HighlightBlob& a, const HighlightBlob& b) { return a.weight > b.weight; });
    extrapolate_clipped(linear, saturation_level, result.grown, result.residual);
    return result;
}

}  // namespace vitrine
