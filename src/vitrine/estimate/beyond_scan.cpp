#include "estimate/beyond_scan.h"

#include "math/optimise.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace vitrine {

namespace {

constexpr int kMinPixels = 12;
constexpr std::size_t kMinViews = 2;
constexpr float kMinShare = 0.5f;   // of a pixel's light: what shows it well
constexpr double kDarkest = 0.003;  // of the bright level
constexpr float kMaxRatio = 2.0f;   // to what was assumed, which in made worlds is off by a fifth,
constexpr double kMargin = 0.03;    // and of the bright level: where next to nothing was
constexpr int kGrid = 15, kEvaluations = 9;
constexpr double kCap = 0.25;  // of the bright level, as in the fit of the index

}  // namespace

void add_beyond(std::vector<ThroughPixel>& through, const Rgb& change) {
    for (ThroughPixel& t : through) {
        t.transmitted += t.beyond.transmitted * change;
        t.reflected += t.beyond.reflected * change;
        t.inner += t.beyond.inner * change;
    }
}

std::optional<Rgb> radiance_beyond(const std::vector<ThroughPixel>& through,
                                   const std::vector<ObjectPixel>& pixels, double bright,
                                   const Rgb& assumed, const std::optional<Rgb>& known_sigma_a) {
    std::set<int> views;
    int shown = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (!through[i].is_valid || pixels[i].is_clipped ||
            through[i].beyond.transmitted < kMinShare)
            continue;
        ++shown;
        views.insert(pixels[i].frame);
    }
    if (shown < kMinPixels || views.size() < kMinViews) return std::nullopt;

    const auto misfit = [&](int channel, double radiance) {
        Rgb change = Rgb::Zero();
        change[channel] = static_cast<float>(radiance) - assumed[channel];
        std::vector<ThroughPixel> trial = through;
        add_beyond(trial, change);
        const Rgb sigma_a = known_sigma_a.value_or(fit_absorption(trial, pixels, bright));
        double sum = 0.0;
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            if (!trial[i].is_valid || pixels[i].is_clipped) continue;
            const double residual =
                double{trial[i].radiance(sigma_a)[channel]} - pixels[i].radiance[channel];
            sum += std::min(std::abs(residual) / bright, kCap);
        }
        return sum;
    };
    Rgb radiance;
    for (int c = 0; c < 3; ++c) {
        const Minimum1d best = minimise_grid_golden(
            [&](double log_radiance) { return misfit(c, std::exp(log_radiance)); },
            std::log(kDarkest * bright), std::log(bright), kGrid, kEvaluations);
        radiance[c] = static_cast<float>(std::exp(best.x));
    }
    // Much brighter than the ambient light it is only where the body is not what it is taken for.
    const Rgb highest = kMaxRatio * assumed + static_cast<float>(kMargin * bright);
    if ((radiance > highest).any()) return std::nullopt;
    return radiance;
}

}  // namespace vitrine
