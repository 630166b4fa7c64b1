#include "capture/exposure_gains.h"

#include "image/colour.h"
#include "math/statistics.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

constexpr int kPixelStep = 6;
constexpr std::size_t kPartners = 6;           // nearest views each view is compared with
constexpr std::size_t kMinPoints = 100;        // of a pair of views
constexpr double kDepthTolerance = 0.02;       // of the depth: the same point
constexpr double kMinGain = 0.015;             // log; below, nobody sees it and shading explains it
constexpr double kMinExplainedVariance = 0.7;  // of the pairs' log ratios, by one gain a frame
constexpr double kDarkShare = 0.01;            // of the bright level: below, noise

struct Pair {
    std::size_t a, b;
    double log_ratio;  ///< of b over a
};

double bright_level(const Capture& capture) {
    std::vector<double> values;
    for (const RgbdFrame& frame : capture.frames) {
        for (std::size_t p = 0; p < frame.colour.size(); p += 997) {
            values.push_back(luminance(frame.colour[p]));
        }
    }
    return values.empty() ? 0.0 : quantile(std::move(values), 0.9);
}

std::vector<std::pair<std::size_t, std::size_t>> neighbours(std::span<const Camera> cameras) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        std::vector<std::pair<double, std::size_t>> others;
        for (std::size_t j = 0; j < cameras.size(); ++j) {
            if (j == i) continue;
            others.emplace_back(
                (cameras[i].centre_in_world() - cameras[j].centre_in_world()).norm(), j);
        }
        std::sort(others.begin(), others.end());
        for (std::size_t k = 0; k < std::min(kPartners, others.size()); ++k) {
            pairs.emplace_back(i, others[k].second);
        }
    }
    return pairs;
}

std::vector<double> log_ratios(const Capture& capture, std::span<const Camera> cameras,
                               std::span<const Mask> excluded, std::size_t a, std::size_t b,
                               double dark) {
    std::vector<double> ratios;
    const RgbdFrame &from = capture.frames[a], &to = capture.frames[b];
    const auto is_excluded = [&](std::size_t frame, int x, int y) {
        return !excluded.empty() && is_inside(excluded[frame], x, y);
    };
    const auto is_usable = [&](const Rgb& c) {
        return !is_saturated(c, capture.saturation_level) && luminance(c) > dark;
    };
    for (int y = 0; y < from.depth_m.height(); y += kPixelStep) {
        for (int x = 0; x < from.depth_m.width(); x += kPixelStep) {
            const double z = from.depth_m(x, y);
            if (z <= 0 || is_excluded(a, x, y) || !is_usable(from.colour(x, y))) continue;
            const Vec3 p = cameras[b].cam_from_world * cameras[a].unproject(x, y, z);
            if (p.z() <= 0) continue;
            const Vec2 pixel = cameras[b].project_camera(p);
            if (!cameras[b].sees(pixel, 1)) continue;
            const int u = static_cast<int>(std::lround(pixel.x()));
            const int v = static_cast<int>(std::lround(pixel.y()));
            if (!(std::abs(to.depth_m(u, v) - p.z()) < kDepthTolerance * p.z())) continue;
            const Rgb there = bilinear(to.colour, pixel.x(), pixel.y());
            if (is_excluded(b, u, v) || !is_usable(there)) continue;
            ratios.push_back(std::log(luminance(there) / luminance(from.colour(x, y))));
        }
    }
    return ratios;
}

/// Log gains of mean 0; pairs that disagree with the others lose weight (L1 by reweighting).
Eigen::VectorXd solve(const std::vector<Pair>& pairs, std::size_t frames) {
    const auto size = static_cast<Eigen::Index>(frames);
    Eigen::VectorXd gain = Eigen::VectorXd::Zero(size);
    for (int round = 0; round < 10; ++round) {
        Eigen::MatrixXd normal = Eigen::MatrixXd::Constant(size, size, 1e-3);  // mean 0
        normal.diagonal().array() += 1e-9;  // frames without pairs stay at 0
        Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
        for (const Pair& pair : pairs) {
            const auto a = static_cast<Eigen::Index>(pair.a), b = static_cast<Eigen::Index>(pair.b);
            const double residual = gain[b] - gain[a] - pair.log_ratio;
            const double weight = round == 0 ? 1.0 : 1.0 / std::max(std::abs(residual), 0.005);
            normal(a, a) += weight;
            normal(b, b) += weight;
            normal(a, b) -= weight;
            normal(b, a) -= weight;
            right[b] += weight * pair.log_ratio;
            right[a] -= weight * pair.log_ratio;
        }
        gain = normal.ldlt().solve(right);
    }
    return gain.array() - gain.mean();
}

}  // namespace

ExposureGains estimate_exposure_gains(const Capture& capture, std::span<const Camera> cameras,
                                      std::span<const Mask> excluded) {
    VITRINE_CHECK_EQ(cameras.size(), capture.frames.size());
    ExposureGains result;
    result.gain.assign(cameras.size(), 1.0);
    const double dark = kDarkShare * bright_level(capture);
    std::vector<Pair> pairs;
    for (const auto& [a, b] : neighbours(cameras)) {
        std::vector<double> ratios = log_ratios(capture, cameras, excluded, a, b, dark);
        if (ratios.size() >= kMinPoints) pairs.push_back({a, b, median(std::move(ratios))});
    }
    result.pairs = pairs.size();
    // Each pair is looked at from both sides: twice as many as independent ones.
    if (pairs.size() < 2 * cameras.size() + 2) return result;
    const Eigen::VectorXd gain = solve(pairs, cameras.size());
    double before = 0, after = 0;
    for (const Pair& pair : pairs) {
        const double residual = pair.log_ratio - gain[static_cast<Eigen::Index>(pair.b)] +
                                gain[static_cast<Eigen::Index>(pair.a)];
        before += pair.log_ratio * pair.log_ratio / double(pairs.size());
        after += residual * residual / double(pairs.size());
    }
    result.disagreement_before = std::sqrt(before);
    result.disagreement_after = std::sqrt(after);
    result.is_significant =
        gain.cwiseAbs().maxCoeff() > kMinGain && after < (1 - kMinExplainedVariance) * before;
    if (!result.is_significant) return result;
    for (std::size_t i = 0; i < result.gain.size(); ++i) {
        result.gain[i] = std::exp(gain[static_cast<Eigen::Index>(i)]);
    }
    return result;
}

void apply_exposure_gains(std::span<const double> gain, Capture& capture) {
    VITRINE_CHECK_EQ(gain.size(), capture.frames.size());
    double largest = 0;
    for (std::size_t i = 0; i < gain.size(); ++i) {
        RgbdFrame& frame = capture.frames[i];
        largest = std::max(largest, gain[i]);
        if (gain[i] == 1.0) continue;
        const auto factor = static_cast<float>(1 / gain[i]);
        for (Rgb& pixel : frame.colour) pixel *= factor;
        frame.exposure *= gain[i];
    }
    if (capture.saturation_level < 1e20) capture.saturation_level /= std::max(largest, 1e-12);
}

}  // namespace vitrine
