#include "estimate/lopez_moreno.h"

#include "estimate/distance_histogram.h"
#include "image/colour.h"
#include "image/filter.h"
#include "math/nnls.h"
#include "math/statistics.h"

#include <optional>

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Median luminance by azimuth of the contour's normal in the picture plane.
struct Contour {
    std::vector<Vec2> normal;       ///< unit, x right, y up
    std::vector<double> luminance;  ///< minus the ambient
    double ambient = 0;
};

Contour measure_contour(const ImageF& y, const Relief& relief, const Mask& excluded, int bins) {
    const ImageF rim = distance_to(mask_not(relief.mask));
    const auto radius = static_cast<float>(relief.inradius_px);
    std::vector<std::vector<double>> values(static_cast<std::size_t>(bins));
    std::vector<double> all;
    const ImageF smooth_rim = gaussian_blur(rim, 1.5);
    for (int row = 0; row < y.height(); ++row) {
        for (int x = 0; x < y.width(); ++x) {
            const float depth = rim(x, row);
            if (!is_inside(relief.mask, x, row) || depth < 0.02f * radius || depth > 0.1f * radius)
                continue;
            if (!excluded.empty() && excluded(x, row) > 127) continue;
            // Outward: against the gradient of the distance to the outside.
            const double gx = smooth_rim.clamped(x - 1, row) - smooth_rim.clamped(x + 1, row);
            const double gy = smooth_rim.clamped(x, row + 1) - smooth_rim.clamped(x, row - 1);
            if (std::hypot(gx, gy) < 1e-6) continue;
            const double azimuth = std::atan2(gy, gx);
            const int bin =
                std::clamp(static_cast<int>((azimuth + kPi) / (2 * kPi) * bins), 0, bins - 1);
            values[static_cast<std::size_t>(bin)].push_back(y(x, row));
            all.push_back(y(x, row));
        }
    }
    Contour contour;
    if (all.empty()) return contour;
    contour.ambient = quantile(all, 0.05);
    for (int b = 0; b < bins; ++b) {
        const std::vector<double>& bin = values[static_cast<std::size_t>(b)];
        if (bin.size() < 3) continue;
        const double azimuth = (b + 0.5) / bins * 2 * kPi - kPi;
        contour.normal.emplace_back(std::cos(azimuth), std::sin(azimuth));
        contour.luminance.push_back(std::max(0.0, median(bin) - contour.ambient));
    }
    return contour;
}

struct AzimuthFit {
    std::vector<Vec2> direction;
    VectorXd intensity;  ///< one per direction, then the ambient
    double rms = 1e300;
};

/// k lights on the contour: directions by weighted assignment, intensities by NNLS.
AzimuthFit fit_azimuths(const Contour& contour, int k) {
    const std::size_t count = contour.normal.size();
    AzimuthFit fit;
    // Start at luminance peaks, each farthest from those before.
    for (int j = 0; j < k; ++j) {
        std::size_t best = 0;
        double score = -1;
        for (std::size_t i = 0; i < count; ++i) {
            double farness = 1;
            for (const Vec2& w : fit.direction)
                farness = std::min(farness, 0.5 * (1 - w.dot(contour.normal[i])));
            if (contour.luminance[i] * farness > score) {
                score = contour.luminance[i] * farness;
                best = i;
            }
        }
        fit.direction.push_back(contour.normal[best]);
    }
    for (int round = 0; round < 50; ++round) {
        std::vector<Vec2> sum(static_cast<std::size_t>(k), Vec2::Zero());
        for (std::size_t i = 0; i < count; ++i) {
            double total = 0;
            for (const Vec2& w : fit.direction) total += std::max(0.0, w.dot(contour.normal[i]));
            if (total <= 0) continue;
            for (std::size_t j = 0; j < sum.size(); ++j) {
                const double share = std::max(0.0, fit.direction[j].dot(contour.normal[i])) / total;
                sum[j] += share * contour.luminance[i] * contour.normal[i];
            }
        }
        for (std::size_t j = 0; j < sum.size(); ++j)
            if (sum[j].norm() > 1e-12) fit.direction[j] = sum[j].normalized();
    }
    MatrixXd a(static_cast<Index>(count), k + 1);
    VectorXd b(static_cast<Index>(count));
    for (std::size_t i = 0; i < count; ++i) {
        for (int j = 0; j < k; ++j) {
            a(static_cast<Index>(i), j) =
                std::max(0.0, fit.direction[static_cast<std::size_t>(j)].dot(contour.normal[i]));
        }
        a(static_cast<Index>(i), k) = 1;
        b[static_cast<Index>(i)] = contour.luminance[i];
    }
    fit.intensity = solve_nnls(a, b).x;
    fit.rms = std::sqrt((a * fit.intensity - b).squaredNorm() / static_cast<double>(count));
    return fit;
}

/// Walks from the contour inward along the light's azimuth (five rays) to the first maximum of the
/// smoothed luminance. @returns cosine of the zenith: n_z there; negative for a light behind.
double zenith_cosine(const ImageF& y, const Relief& relief, const Vec2& azimuth) {
    Vec2 centre = Vec2::Zero();
    double count = 0;
    for (int row = 0; row < y.height(); ++row) {
        for (int x = 0; x < y.width(); ++x) {
            if (!is_inside(relief.mask, x, row)) continue;
            centre += Vec2(x, row);
            count += 1;
        }
    }
    centre /= count;
    const Image<Vec3f>& normals =
        relief.base_normals.empty() ? relief.normals : relief.base_normals;
    std::vector<double> cosines;
    for (int ray = -2; ray <= 2; ++ray) {
        const double turn = radians(10.0 * ray);
        const Vec2 d(std::cos(turn) * azimuth.x() - std::sin(turn) * azimuth.y(),
                     std::sin(turn) * azimuth.x() + std::cos(turn) * azimuth.y());
        // From outside toward the centre and on to the far side, one pixel at a time.
        const double reach = std::hypot(y.width(), y.height());
        std::vector<double> luminances, heights;
        for (double t = reach; t > -reach; t -= 1) {
            const int x = static_cast<int>(std::lround(centre.x() + t * d.x()));
            const int row = static_cast<int>(std::lround(centre.y() - t * d.y()));
            if (!is_inside(relief.mask, x, row)) {
                if (t < 0) break;
                luminances.clear();
                heights.clear();
                continue;
            }
            luminances.push_back(y(x, row));
            heights.push_back(normals(x, row).z());
        }
        if (luminances.size() < 8) continue;
        const auto skip = static_cast<std::size_t>(0.03 * relief.inradius_px) + 1;
        std::size_t top = std::min(skip, luminances.size() - 1);
        for (std::size_t i = top; i < luminances.size(); ++i)
            if (luminances[i] > luminances[top]) top = i;
        if (top > skip + 1) {
            cosines.push_back(heights[top]);
            continue;
        }
        // Only falling: the light is behind. The shadow line, where half of the fall is over, lies
        // perpendicular to the light: n_z there is the sine of how far behind it is.
        const double low = *std::min_element(luminances.begin(), luminances.end());
        const double half = 0.5 * (luminances[skip] + low);
        std::size_t line = skip;
        while (line + 1 < luminances.size() && luminances[line] > half) ++line;
        cosines.push_back(-std::sqrt(std::max(0.0, 1 - heights[line] * heights[line])) *
                          (heights[line] < 0.98 ? heights[line] : 0.98));
    }
    return cosines.empty() ? 0.5 : std::clamp(median(cosines), -0.95, 0.99);
}

}  // namespace

ViewLightsEstimate estimate_lopez_moreno_lights(const ImageRgb& diffuse, const Relief& relief,
                                                const Mask& excluded,
                                                const LopezMorenoOptions& options) {
    ViewLightsEstimate result;
    const ImageF y = gaussian_blur(luminance_image(diffuse), 0.03 * relief.inradius_px);
    const Contour contour = measure_contour(y, relief, excluded, options.azimuth_bins);
    if (contour.normal.size() < 12) {
        result.lights.ambient = Rgbd::Constant(kPi);
        result.outcome = Outcome::NotIdentifiable;
        result.reason = "too little of the contour can be seen";
        return result;
    }
    AzimuthFit best = fit_azimuths(contour, 1);
    for (int k = 2; k <= options.max_lights; ++k) {
        AzimuthFit next = fit_azimuths(contour, k);
        if (next.rms > (1 - options.min_improvement) * best.rms) break;
        best = std::move(next);
    }
    for (std::size_t j = 0; j < best.direction.size(); ++j) {
        const double intensity = best.intensity[static_cast<Index>(j)];
        if (intensity <= 0) continue;
        const double cosine = zenith_cosine(y, relief, best.direction[j]);
        const double sine = std::sqrt(1 - cosine * cosine);
        result.lights.lights.push_back(
            {Vec3(sine * best.direction[j].x(), sine * best.direction[j].y(), cosine),
             Rgbd::Constant(intensity / std::max(sine, 0.35))});
    }
    std::stable_sort(
        result.lights.lights.begin(), result.lights.lights.end(),
        [](const ViewLight& a, const ViewLight& b) { return a.intensity[0] > b.intensity[0]; });
    result.lights.ambient =
        Rgbd::Constant(contour.ambient + best.intensity[static_cast<Index>(best.direction.size())]);
    if (result.lights.total() <= 0) {
        result.lights.ambient = Rgbd::Constant(kPi);
        result.outcome = Outcome::NotIdentifiable;
        result.reason = "the contour is black";
        return result;
    }
    result.relative_residual = best.rms / std::max(mean(contour.luminance), 1e-9);
    normalise_and_warn(result, relief, options.eta);
    return result;
}

}  // namespace vitrine
