// Wall thickness of hollow glass; declared in estimate/transparent.h.
#include "estimate/transparent.h"
#include "math/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vitrine {

namespace {

// Factors of 1.41 from a light bulb to a jar: finer than a hull's outline tells.
constexpr std::array<double, 9> kWalls = {0.0005, 0.0007, 0.001,  0.0014, 0.002,
                                          0.0028, 0.004,  0.0057, 0.008};
constexpr std::size_t kFactorTwo = 2;      // places in the list
constexpr double kMinWallLength = 0.0015;  // metres of glass in which a tint shows at all
constexpr int kBootstrapRounds = 40;
constexpr double kMinEvidence = 2.0;  // deviations by which half and double must be worse
constexpr double kWallDoubt = 0.25;   // of the logarithm: the base and the rim are not modelled
constexpr double kIndexDoubt = 0.1;   // of common glasses
constexpr double kTintDoubt = 0.5;    // relative: tint and wall only show as a product

double interpolated_minimum(const std::array<double, kWalls.size()>& cost, std::size_t best) {
    const double log_wall = std::log(kWalls[best]);
    if (best == 0 || best + 1 == kWalls.size()) return kWalls[best];
    const double before = cost[best - 1], at = cost[best], after = cost[best + 1];
    const double curvature = before + after - 2.0 * at;
    if (curvature <= 0.0) return kWalls[best];
    const double step = 0.5 * (before - after) / curvature;
    return std::exp(log_wall + step * 0.5 * std::log(2.0));
}

}  // namespace

TransparentFit fit_shell(const EstimationScene& scene, const FrameLookup& lookup, int object,
                         const std::vector<ObjectPixel>& pixels, double bright,
                         const TransparentOptions& options) {
    TransparentFit fit;
    fit.is_shell = true;
    const double ior = options.known_ior.value_or(options.shell_ior);
    std::array<std::vector<ThroughPixel>, kWalls.size()> through;
    std::array<Rgb, kWalls.size()> tint;
    std::array<double, kWalls.size()> cost{};
    const auto least = [](const std::array<double, kWalls.size()>& costs) {
        return static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) -
                                        costs.begin());
    };
    for (std::size_t k = 0; k < kWalls.size(); ++k) {
        through[k] =
            look_through_vessel(scene, lookup, object, pixels, ior, kWalls[k], options.ambient);
        tint[k] = options.known_sigma_a.value_or(
            fit_absorption(through[k], pixels, bright, kMinWallLength));
        cost[k] = through_cost(through[k], pixels, tint[k], bright);
    }
    const std::size_t best = least(cost);
    fit.wall_m.value = interpolated_minimum(cost, best);
    fit.sigma_a_per_m.value = tint[best];
    fit.cost = cost[best];
    fit.explained = share_explained(through[best]);

    // Whole views drawn with replacement; half and double the wall against the best, view by view.
    const int views = static_cast<int>(lookup.frames().size());
    std::vector<double> log_walls;
    for (int round = 0; round < kBootstrapRounds; ++round) {
        const std::vector<int> count =
            resample_views(pixels, views, static_cast<std::uint64_t>(round));
        std::array<double, kWalls.size()> drawn{};
        for (std::size_t k = 0; k < kWalls.size(); ++k)
            drawn[k] = through_cost(through[k], pixels, tint[k], bright, count);
        log_walls.push_back(std::log(interpolated_minimum(drawn, least(drawn))));
    }
    fit.wall_m.stddev = fit.wall_m.value * std::hypot(standard_deviation(log_walls), kWallDoubt);
    const auto evidence_against = [&](std::size_t other) {
        double sum = 0.0, square = 0.0;
        for (int view = 0; view < views; ++view) {
            std::vector<int> only(pixels.size());
            double seen = 0.0;
            for (std::size_t i = 0; i < pixels.size(); ++i) {
                only[i] = pixels[i].frame == view;
                seen += only[i];
            }
            if (seen == 0.0) continue;
            const double d =
                seen * (through_cost(through[other], pixels, tint[other], bright, only) -
                        through_cost(through[best], pixels, tint[best], bright, only));
            sum += d;
            square += d * d;
        }
        return square > 0.0 ? sum / std::sqrt(square) : 0.0;
    };
    fit.wall_m.outcome = Outcome::Converged;
    if (is_indifferent(cost[best], *std::max_element(cost.begin(), cost.end()))) {
        fit.wall_m.outcome = Outcome::NotIdentifiable;
        fit.wall_m.reason = "the background is too even: it looks the same through any wall";
    } else if (best < kFactorTwo) {
        // The hull of an open vessel has a lid and a base as thin as its walls: the thinner all of
        // them, the less is wrong with it, whatever the wall.
        fit.wall_m.outcome = Outcome::NotIdentifiable;
        fit.wall_m.reason =
            "the thinnest walls explain it best: the lid that outlines put on an open vessel and "
            "its thick base hide what the wall does";
    } else if (best + kFactorTwo >= kWalls.size()) {
        fit.wall_m.outcome = Outcome::AtBound;
        fit.wall_m.reason = "the best wall is as thick as walls are looked for";
    } else if (std::min(evidence_against(best - kFactorTwo), evidence_against(best + kFactorTwo)) <
               kMinEvidence) {
        fit.wall_m.outcome = Outcome::NotIdentifiable;
        fit.wall_m.reason = "half or double this wall looks about the same";
    }

    fit.ior.value = ior;
    fit.ior.stddev = options.known_ior ? 0.0 : kIndexDoubt;
    fit.ior.outcome = options.known_ior ? Outcome::Converged : Outcome::NotIdentifiable;
    if (!options.known_ior)
        fit.ior.reason = "thin walls hardly bend light: the index of common glass is assumed";
    fit.sigma_a_per_m.outcome = Outcome::Converged;
    if (!options.known_sigma_a) {
        fit.sigma_a_per_m.stddev =
            Rgb::Constant(1.0f) + fit.sigma_a_per_m.value * static_cast<float>(kTintDoubt);
        fit.sigma_a_per_m.outcome = Outcome::NotIdentifiable;
        fit.sigma_a_per_m.reason = "only the product of tint and wall shows";
    }
    fit.ior.residual_rms = fit.sigma_a_per_m.residual_rms = fit.wall_m.residual_rms = fit.cost;
    return fit;
}

}  // namespace vitrine
