#include "reconstruct/relief.h"

#include "base/parallel.h"
#include "image/filter.h"
#include "image/poisson.h"

#include <opencv2/imgproc.hpp>

namespace vitrine {
namespace {

double inradius(const Mask& mask) {
    Mask outside(mask.width() + 2, mask.height() + 2, 255);
    for (int y = 0; y < mask.height(); ++y)
        for (int x = 0; x < mask.width(); ++x)
            if (is_inside(mask, x, y)) outside(x + 1, y + 1) = 0;
    float radius = 0;
    for (const float distance : distance_to(outside)) radius = std::max(radius, distance);
    return radius;
}

/// Naka-Rushton compression around the log-average luminance (Khan et al. 2006, Eq. 1), n = 1.
ImageF compressed_luminance(const ImageRgb& image, const Mask& mask) {
    double log_sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
        if (mask[i] <= 127) continue;
        log_sum += std::log(std::max(luminance(image[i]), 1e-4f));
        ++count;
    }
    const auto average = static_cast<float>(std::exp(log_sum / std::max<std::size_t>(count, 1)));
    ImageF result(image.width(), image.height());
    for (std::size_t i = 0; i < image.size(); ++i) {
        const float y = std::max(luminance(image[i]), 0.0f);
        result[i] = y / (y + average);
    }
    return result;
}

/// Fine minus coarse luminance, per pixel, from bilateral filters at a reduced size.
ImageF shading_detail(const ImageRgb& diffuse, const Mask& mask, double radius,
                      const ReliefOptions& options) {
    const ImageF luminance_in = extend_nearest(compressed_luminance(diffuse, mask), mask);
    constexpr double kWorkRadius = 80;  // inradius in pixels at which the filters run
    const double shrink = std::min(1.0, kWorkRadius / radius);
    const cv::Mat full(mask.height(), mask.width(), CV_32FC1,
                       const_cast<float*>(luminance_in.data()));
    cv::Mat small, fine, coarse, detail;
    cv::resize(full, small, cv::Size(), shrink, shrink, cv::INTER_AREA);
    const double sigma = options.sigma_spatial * radius * shrink;
    const auto filter = [&](cv::Mat& to, double sigma_space, double sigma_range) {
        const int diameter = 2 * static_cast<int>(std::ceil(1.7 * sigma_space)) + 1;
        cv::bilateralFilter(small, to, diameter, sigma_range, sigma_space, cv::BORDER_REPLICATE);
    };
    filter(fine, sigma, 0.075);
    filter(coarse, 6 * sigma, 0.15);
    cv::resize(fine - coarse, detail, full.size(), 0, 0, cv::INTER_CUBIC);
    ImageF result(mask.width(), mask.height());
    for (int y = 0; y < mask.height(); ++y)
        for (int x = 0; x < mask.width(); ++x) result(x, y) = detail.at<float>(y, x);
    return shrink < 1 ? gaussian_blur(result, 0.5 / shrink) : result;
}

}  // namespace

Image<Vec3f> relief_normals(const ImageF& depth_px, const Mask& mask, double sigma_px) {
    // Z has a vertical tangent at the rim; Q = Z^2 does not: Z_x = Q_x / (2 Z).
    ImageF q(mask.width(), mask.height());
    for (std::size_t i = 0; i < q.size(); ++i) q[i] = mask[i] > 127 ? depth_px[i] * depth_px[i] : 0;
    q = gaussian_blur(q, sigma_px);
    Image<Vec3f> normals(mask.width(), mask.height(), Vec3f(0, 0, 1));
    parallel_for(static_cast<std::size_t>(mask.height()), 16, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < mask.width(); ++x) {
            if (!is_inside(mask, x, y)) continue;
            const float two_z = 2 * std::max(depth_px(x, y), 0.5f);
            const float zx = 0.5f * (q.clamped(x + 1, y) - q.clamped(x - 1, y)) / two_z;
            const float zy = 0.5f * (q.clamped(x, y - 1) - q.clamped(x, y + 1)) / two_z;  // y up
            normals(x, y) = Vec3f(-zx, -zy, 1).normalized();
        }
    });
    return normals;
}

Relief shade_to_shape(const ImageRgb& diffuse, const Mask& mask, const ReliefOptions& options) {
    VITRINE_CHECK(mask.same_size(diffuse));
    Relief relief;
    relief.mask = mask;
    relief.inradius_px = inradius(mask);
    VITRINE_CHECK_GT(relief.inradius_px, 0.0);
    const ImageF u = inflate(mask);
    float highest = 0;
    for (std::size_t i = 0; i < u.size(); ++i)
        if (mask[i] > 127) highest = std::max(highest, u[i]);
    const ImageF detail = options.alpha > 0
                              ? shading_detail(diffuse, mask, relief.inradius_px, options)
                              : ImageF(mask.width(), mask.height());
    relief.depth_px = ImageF(mask.width(), mask.height());
    const auto scale = static_cast<float>(relief.inradius_px * options.depth);
    const auto gain = static_cast<float>(options.alpha * options.detail_gain);
    ImageF base_px(mask.width(), mask.height());
    for (std::size_t i = 0; i < u.size(); ++i) {
        if (mask[i] <= 127) continue;
        const float dome = std::sqrt(std::max(u[i], 0.0f) / highest);
        base_px[i] = scale * dome;
        // The detail fades toward the rim, where it would move the contour.
        relief.depth_px[i] =
            scale * std::max(dome + gain * detail[i] * std::sqrt(dome), 0.02f * dome);
    }
    relief.normals = relief_normals(relief.depth_px, mask);
    relief.base_normals = options.alpha > 0 ? relief_normals(base_px, mask) : relief.normals;
    return relief;
}

}  // namespace vitrine
