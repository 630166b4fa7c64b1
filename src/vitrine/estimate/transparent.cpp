#include "estimate/transparent.h"

#include "base/log.h"
#include "base/rng.h"
#include "estimate/beyond_scan.h"
#include "estimate/model_error.h"
#include "math/optimise.h"
#include "math/statistics.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr double kCap = 0.25;  // of the bright level: beyond, a pixel is simply wrong
constexpr int kIorGrid = 21;   // step 0.04: no basin of the objective is narrower
constexpr int kBootstrapRounds = 40;
constexpr double kMinExplained = 0.15;

double pixel_cost(const ThroughPixel& t, const ObjectPixel& p, const Rgb& sigma_a, double bright) {
    const Rgb residual = t.radiance(sigma_a) - p.radiance;
    return std::min(static_cast<double>(residual.abs().mean()) / bright, kCap);
}

/// Half the stretch of rising `x` around the least `cost` on which it is less than `factor` times
/// that; straight between the trials, and no further than they go.
double half_width(const std::vector<double>& x, const std::vector<double>& cost, double factor) {
    const auto least = std::min_element(cost.begin(), cost.end()) - cost.begin();
    const double limit = factor * cost[static_cast<std::size_t>(least)];
    const auto reach = [&](std::ptrdiff_t step) {
        const auto last = step > 0 ? static_cast<std::ptrdiff_t>(x.size()) - 1 : 0;
        for (std::ptrdiff_t k = least; k != last; k += step) {
            const auto here = static_cast<std::size_t>(k),
                       next = static_cast<std::size_t>(k + step);
            if (cost[next] <= limit) continue;
            const double share = (limit - cost[here]) / (cost[next] - cost[here]);
            return x[here] + share * (x[next] - x[here]);
        }
        return x[static_cast<std::size_t>(last)];
    };
    return 0.5 * (reach(1) - reach(-1));
}

/// Between the trials around the best, far enough apart to be more than noise.
Rgb slope_around(const std::vector<double>& x, const std::vector<Rgb>& y, double best) {
    constexpr double kNear = 0.01;
    const auto above = std::find_if(x.begin(), x.end(), [&](double v) { return v > best + kNear; });
    const auto past_below =
        std::find_if(x.begin(), x.end(), [&](double v) { return v >= best - kNear; });
    if (above == x.end() || past_below == x.begin()) return Rgb::Zero();
    const auto high = static_cast<std::size_t>(above - x.begin());
    const auto low = static_cast<std::size_t>(past_below - x.begin()) - 1;
    return (y[high] - y[low]) / static_cast<float>(x[high] - x[low]);
}

double typical_length(const std::vector<ThroughPixel>& through) {
    std::vector<double> lengths;
    for (const ThroughPixel& t : through)
        if (t.is_valid) lengths.push_back(t.length_m);
    return lengths.empty() ? 0.0 : quantile(lengths, 0.5);
}

}  // namespace

// Light from inside depends on the answer, so three rounds.
Rgb fit_absorption(const std::vector<ThroughPixel>& through, const std::vector<ObjectPixel>& pixels,
                   double bright, double min_length_m, const std::vector<int>& count) {
    constexpr int kRounds = 3;
    Rgb sigma_a = Rgb::Zero();
    std::vector<double> value, weight;
    for (int round = 0; round < kRounds; ++round) {
        const Rgb last = sigma_a;
        for (int c = 0; c < 3; ++c) {
            value.clear();
            weight.clear();
            double total = 0.0;
            for (std::size_t i = 0; i < pixels.size(); ++i) {
                const ThroughPixel& t = through[i];
                if (!t.is_valid || pixels[i].is_clipped ||
                    static_cast<double>(t.length_m) < min_length_m)
                    continue;
                if (!count.empty() && count[i] == 0) continue;
                const double r0 = t.transmitted[c];
                if (r0 < 0.02 * bright) continue;
                const double r = pixels[i].radiance[c] - t.side_light(last)[c];
                // Darker than its reflections only says "much": keep it, at a large value.
                value.push_back(std::log(r0 / std::max(r, 0.002 * bright)) / t.length_m);
                weight.push_back(t.length_m * (count.empty() ? 1 : count[i]));
                total += weight.back();
            }
            if (total > 0.0)
                sigma_a[c] = static_cast<float>(std::max(0.0, weighted_median(value, weight)));
        }
    }
    return sigma_a;
}

double through_cost(const std::vector<ThroughPixel>& through,
                    const std::vector<ObjectPixel>& pixels, const Rgb& sigma_a, double bright,
                    const std::vector<int>& count) {
    double sum = 0.0, total = 0.0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (!through[i].is_valid || pixels[i].is_clipped) continue;
        const double w = count.empty() ? 1.0 : count[i];
        sum += w * pixel_cost(through[i], pixels[i], sigma_a, bright);
        total += w;
    }
    return total > 0.0 ? sum / total : 1.0;
}

double share_explained(const std::vector<ThroughPixel>& through) {
    const auto valid = std::count_if(through.begin(), through.end(),
                                     [](const ThroughPixel& t) { return t.is_valid; });
    return through.empty() ? 0.0 : static_cast<double>(valid) / static_cast<double>(through.size());
}

bool is_indifferent(double least, double greatest) {
    constexpr double kMinCostContrast = 1.15;
    constexpr double kMinCostSpread = 0.02;  // of the bright level: gain errors of the pictures
    return greatest < std::max(kMinCostContrast * least, least + kMinCostSpread);
}

std::vector<int> resample_views(const std::vector<ObjectPixel>& pixels, int view_count,
                                std::uint64_t round) {
    Rng rng(stream_key(0xb007u, round));
    std::vector<int> drawn(static_cast<std::size_t>(view_count), 0);
    for (int k = 0; k < view_count; ++k)
        ++drawn[rng.next_index(static_cast<std::uint32_t>(view_count))];
    std::vector<int> count(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i)
        count[i] = drawn[static_cast<std::size_t>(pixels[i].frame)];
    return count;
}

TransparentFit fit_solid(const EstimationScene& scene, const FrameLookup& lookup, int object,
                         const std::vector<ObjectPixel>& pixels, double bright,
                         const TransparentOptions& options) {
    TransparentFit fit;
    const auto sigma_for = [&](const std::vector<ThroughPixel>& through,
                               const std::vector<int>& count) {
        return options.known_sigma_a
                   ? *options.known_sigma_a
                   : fit_absorption(through, pixels, bright, kMinSolidLength, count);
    };
    std::vector<double> trial;
    std::vector<std::vector<ThroughPixel>> predicted;
    double greatest = 0.0;
    Rgb beyond = options.ambient;
    const auto at_index = [&](double ior) {
        return look_through(scene, lookup, object, pixels, ior, beyond);
    };
    const auto evaluate = [&](double ior) {
        const std::size_t k =
            static_cast<std::size_t>(std::find(trial.begin(), trial.end(), ior) - trial.begin());
        if (k == trial.size()) {
            predicted.push_back(at_index(ior));
            trial.push_back(ior);
        }
        const double cost =
            through_cost(predicted[k], pixels, sigma_for(predicted[k], {}), bright, {});
        greatest = std::max(greatest, cost);
        return cost;
    };
    const auto learn_beyond = [&](double ior) {
        if (options.is_ambient_known) return;
        const std::optional<Rgb> radiance =
            radiance_beyond(at_index(ior), pixels, bright, beyond, options.known_sigma_a);
        log_debug("beyond the scan: {:.4f} {:.4f} {:.4f} assumed, {:.4f} {:.4f} {:.4f} seen",
                  beyond[0], beyond[1], beyond[2], radiance.value_or(beyond)[0],
                  radiance.value_or(beyond)[1], radiance.value_or(beyond)[2]);
        if (!radiance) return;
        for (std::vector<ThroughPixel>& through : predicted)
            add_beyond(through, *radiance - beyond);
        beyond = *radiance;
        greatest = 0.0;
    };
    double best_ior = 0.0;
    if (options.known_ior) {
        best_ior = *options.known_ior;
        learn_beyond(best_ior);
        evaluate(best_ior);
    } else {
        learn_beyond(
            minimise_grid_golden(evaluate, options.ior_min, options.ior_max, kIorGrid, 0).x);
        const Minimum1d minimum =
            minimise_grid_golden(evaluate, options.ior_min, options.ior_max, kIorGrid, 9);
        best_ior = minimum.x;
        if (options.ior_step > 0.0)
            best_ior =
                options.ior_min +
                options.ior_step * std::round((best_ior - options.ior_min) / options.ior_step);
        if (!options.ior_grid.empty())
            best_ior = *std::min_element(options.ior_grid.begin(), options.ior_grid.end(),
                                         [free = best_ior](double a, double b) {
                                             return std::abs(a - free) < std::abs(b - free);
                                         });
        fit.ior.outcome = minimum.is_at_bound ? Outcome::AtBound : Outcome::Converged;
        if (minimum.is_at_bound) fit.ior.reason = "the best index lies at the end of the range";
    }
    const std::vector<ThroughPixel> best = at_index(best_ior);
    fit.beyond = beyond;
    fit.ior.value = best_ior;
    fit.sigma_a_per_m.value = sigma_for(best, {});
    fit.cost = through_cost(best, pixels, fit.sigma_a_per_m.value, bright, {});
    fit.explained = share_explained(best);
    fit.ior.residual_rms = fit.sigma_a_per_m.residual_rms = fit.cost;

    // Bootstrap over views among the trials already traced, with a parabola between them.
    std::vector<double> iors;
    std::array<std::vector<double>, 3> sigmas;
    const int views = static_cast<int>(lookup.frames().size());
    std::vector<std::size_t> order(trial.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return trial[a] < trial[b]; });
    const auto doubt_of = [&]() {
        SolidDoubt doubt;
        doubt.length_m = typical_length(best);
        std::vector<double> iors_rising, cost;
        std::vector<Rgb> absorption;
        for (const std::size_t k : order) {
            iors_rising.push_back(trial[k]);
            absorption.push_back(sigma_for(predicted[k], {}));
            cost.push_back(through_cost(predicted[k], pixels, absorption.back(), bright, {}));
        }
        doubt.ior_half_width = half_width(iors_rising, cost, kAlikeCost);
        doubt.absorption_per_ior = slope_around(iors_rising, absorption, best_ior);
        return doubt;
    };
    for (int round = 0; round < kBootstrapRounds; ++round) {
        const std::vector<int> count =
            resample_views(pixels, views, static_cast<std::uint64_t>(round));
        std::size_t at = order[0];
        double least = 2.0;
        for (const std::size_t k : order) {
            const double cost =
                through_cost(predicted[k], pixels, sigma_for(predicted[k], count), bright, count);
            if (cost < least) {
                least = cost;
                at = k;
            }
        }
        iors.push_back(trial[at]);
        const Rgb sigma = sigma_for(predicted[at], count);
        for (int c = 0; c < 3; ++c) sigmas[static_cast<std::size_t>(c)].push_back(sigma[c]);
    }
    fit.ior.stddev = options.known_ior ? 0.0 : standard_deviation(iors);
    for (int c = 0; c < 3 && !options.known_sigma_a; ++c)
        fit.sigma_a_per_m.stddev[c] =
            static_cast<float>(standard_deviation(sigmas[static_cast<std::size_t>(c)]));
    add_model_error(fit, options, doubt_of());
    fit.sigma_a_per_m.outcome = Outcome::Converged;
    if (options.known_ior) fit.ior.outcome = Outcome::Converged;
    if (fit.explained < kMinExplained) {
        fit.ior.outcome = fit.sigma_a_per_m.outcome = Outcome::NotIdentifiable;
        fit.ior.reason = fit.sigma_a_per_m.reason =
            "too little of what is seen through the object is seen past it in another view";
    } else if (!options.known_ior && is_indifferent(fit.cost, greatest)) {
        fit.ior.outcome = Outcome::NotIdentifiable;
        fit.ior.reason = "the background is too even: it looks the same through any index";
    } else if (!options.known_ior && fit.ior.stddev > 0.1) {
        fit.ior.outcome = Outcome::Ambiguous;
        fit.ior.reason = "different views ask for different indices";
        if (!options.known_sigma_a) {
            fit.sigma_a_per_m.outcome = Outcome::Ambiguous;
            fit.sigma_a_per_m.reason =
                "the ways through it depend on its index, which is ambiguous";
        }
    }
    return fit;
}

}  // namespace vitrine
