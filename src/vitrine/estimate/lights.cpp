#include "estimate/lights.h"

#include "base/log.h"
#include "estimate/known_lights.h"
#include "estimate/light_data.h"
#include "estimate/light_outcome.h"
#include "estimate/light_search.h"
#include "math/optimise.h"
#include "math/statistics.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr int kScoutStride = 3;        // one third of the samples finds the basin
constexpr int kDensePerCandidate = 4;  // shadows of small things lock within half a step of it
constexpr double kMinStartSeparationRad = 0.35;  // one and a half steps of the dense grid
constexpr std::size_t kStarts = 5;               // grid lights that are refined
// A second light must explain this share of what one leaves (by evidence, see docs/estimation.md).
constexpr double kSecondLightGain = 0.18;
constexpr double kMinSecondShare = 0.08;  // of the irradiance: weaker ones are texture
constexpr int kRestarts = 3;
constexpr double kSettled = 0.995;            // a restart that gains less is the last
constexpr double kNearPerRadius = 3.0;        // radii of the scene: a lamp over a table
constexpr double kMinDistanceEvidence = 2.0;  // deviations; less, and it may be the sun
constexpr double kMinSeparationRad = 0.436;

/// A distant light stays distant while it is refined.
RefineOptions with_distances_of(const LightFit& fit, const LightSet& set, RefineOptions options) {
    options.keep_distances = has_distant(fit, set);
    return options;
}

/// The best grid lights, no two of one basin.
std::vector<LightSet> starts_of(const std::vector<LightSet>& singles) {
    std::vector<LightSet> starts;
    for (const LightSet& single : singles) {
        const bool is_apart = std::all_of(starts.begin(), starts.end(), [&](const LightSet& start) {
            return angle_between(start.lights[0].direction, single.lights[0].direction) >
                   kMinStartSeparationRad;
        });
        if (is_apart) starts.push_back(single);
        if (starts.size() == kStarts) break;
    }
    return starts;
}

LightSet find_lights(const LightFit& fit, const LightOptions& options, LightEstimate& estimate,
                     const Progress& progress) {
    const HemisphereGrid grid = make_hemisphere(fit.samples(), options.candidate_count);
    const std::vector<LightSet> singles = search_single(fit, grid, kScoutStride);
    estimate.error_initial = singles.front().score.cost;
    estimate.grid_direction = singles.front().lights[0].direction;
    progress.update(0.3, "refining the light");

    const RefineOptions scout{.stride = kScoutStride,
                              .disc_samples = 8,
                              .max_evaluations = 70,
                              .step_rad = 0.12,
                              .refine_radius = false};
    std::vector<LightSet> refined;
    const HemisphereGrid dense =
        make_hemisphere(fit.samples(), kDensePerCandidate * options.candidate_count);
    for (const LightSet& start : starts_of(search_single(fit, dense, kScoutStride))) {
        refined.push_back(refine_lights(fit, start, with_distances_of(fit, start, scout)));
        const Vec3& d = refined.back().lights[0].direction;
        log_debug("lights: start cost {:.4f} -> {:.4f} toward ({:.2f}, {:.2f}, {:.2f})",
                  start.score.cost, refined.back().score.cost, d.x(), d.y(), d.z());
    }
    std::stable_sort(refined.begin(), refined.end(), [](const LightSet& a, const LightSet& b) {
        return a.score.cost < b.score.cost;
    });
    const RefineOptions fine{
        .stride = 1, .disc_samples = 16, .max_evaluations = 140, .step_rad = 0.04};
    LightSet best =
        refine_lights(fit, refined.front(), with_distances_of(fit, refined.front(), fine));
    progress.update(0.6, "looking for a second light");

    for (int count = 2; count <= options.max_lights; ++count) {
        std::vector<LightSet> firsts = {best};
        firsts.insert(
            firsts.end(), singles.begin(),
            singles.begin() + static_cast<long>(std::min<std::size_t>(6, singles.size())));
        std::vector<LightSet> pairs = search_pairs(fit, grid, firsts, kScoutStride);
        RefineOptions pair_scout = scout;
        pair_scout.max_evaluations = 150;
        LightSet best_pair;
        best_pair.score.cost = 2.0;
        for (std::size_t i = 0; i < std::min<std::size_t>(3, pairs.size()); ++i) {
            LightSet pair =
                refine_lights(fit, pairs[i], with_distances_of(fit, pairs[i], pair_scout));
            if (pair.score.cost < best_pair.score.cost) best_pair = pair;
        }
        if (best_pair.lights.empty()) break;
        const LightScore one =
            fit.score(columns_of(fit, best.lights, 8, kScoutStride), kScoutStride, kLuminance);
        log_debug("lights: {} cost {:.4f}, {} cost {:.4f}", count - 1, one.cost, count,
                  best_pair.score.cost);
        if (best_pair.score.cost > (1.0 - kSecondLightGain) * one.cost) break;
        RefineOptions pair_fine = fine;
        pair_fine.max_evaluations = 260;
        pair_fine = with_distances_of(fit, best_pair, pair_fine);
        best_pair = refine_lights(fit, best_pair, pair_fine);
        // Ten unknowns: one simplex stalls, a fresh one goes on.
        for (int again = 0; again < kRestarts; ++again) {
            const LightSet next = refine_lights(fit, best_pair, pair_fine);
            const bool has_settled = next.score.cost > kSettled * best_pair.score.cost;
            if (next.score.cost < best_pair.score.cost) best_pair = next;
            if (has_settled) break;
        }
        double total = 0.0, least = 1e30;
        for (const PolarLight& light : best_pair.lights) {
            const double e = light.weight / (light.distance_m * light.distance_m);
            total += e;
            least = std::min(least, e);
        }
        const PolarLight& last = best_pair.lights.back();
        bool is_apart = true;
        for (std::size_t i = 0; i + 1 < best_pair.lights.size(); ++i)
            is_apart &=
                angle_between(best_pair.lights[i].direction, last.direction) > kMinSeparationRad;
        if (least < kMinSecondShare * total || !is_apart) break;
        best = best_pair;
    }
    return best;
}

/// Strength per channel: ambient ratio, scale and, with several lights, their shares.
void fit_channels(const LightFit& fit, const LightSet& set, LightEstimate& estimate) {
    constexpr int kDiscSamples = 32;
    std::vector<DirectColumn> columns;
    for (const PolarLight& light : set.lights)
        columns.push_back(
            fit.column(to_trial(light, fit.samples().reference_point), kDiscSamples, 1));
    for (int channel = 0; channel < 3; ++channel) {
        const auto combined = [&](const std::vector<double>& log_share) {
            LightColumns sum;
            for (std::size_t k = 0; k < columns.size(); ++k)
                sum.add(columns[k],
                        set.lights[k].weight * (k == 0 ? 1.0 : std::exp(log_share[k - 1])));
            return sum;
        };
        std::vector<double> share(columns.size() - 1, 0.0);
        if (!share.empty()) {
            const MinimumNd best = minimise_nelder_mead(
                [&](const std::vector<double>& x) {
                    return fit.score(combined(x), 1, channel).cost;
                },
                share, std::vector<double>(share.size(), 0.1), {.max_evaluations = 40});
            share = best.x;
        }
        const LightScore score = fit.score(combined(share), 1, channel);
        for (std::size_t k = 0; k < columns.size(); ++k)
            estimate.lights[k].light.intensity_w_per_sr[channel] = static_cast<float>(
                score.intensity * set.lights[k].weight * (k == 0 ? 1.0 : std::exp(share[k - 1])));
        estimate.ambient_radiance[channel] =
            static_cast<float>(score.ambient_ratio * score.intensity);
    }
}

/// Compares light `k` near and far; true when the pictures show how near it is.
bool keep_nearer_if_evident(const LightFit& fit, LightSet& set, std::size_t k) {
    const double far_m = 0.9 * kDistantPerRadius * fit.samples().scene_radius_m;
    const bool starts_far = set.lights[k].distance_m > far_m;
    const LightSet other =
        at_distance(fit, set, k, starts_far ? kNearPerRadius : kDistantPerRadius);
    const LightSet& near = starts_far ? other : set;
    const LightSet& far = starts_far ? set : other;
    const bool is_near = evidence_of_distance(fit, near, far) >= kMinDistanceEvidence;
    if (is_near == starts_far) set = other;
    return is_near;
}

LightSet from_lights(const std::vector<DiscLight>& lights, const Vec3& reference) {
    LightSet set;
    for (const DiscLight& light : lights) {
        const Vec3 d = light.position_m - reference;
        const double strength = luminance(light.intensity_w_per_sr);
        const double first = luminance(lights.front().intensity_w_per_sr);
        set.lights.push_back({d.normalized(), d.norm(), std::max(light.radius_m, 1e-3),
                              first > 0 ? strength / first : 1.0});
    }
    return set;
}

}  // namespace

LightEstimate estimate_lights(const Scene& scene, std::span<const RgbdFrame> frames,
                              double saturation_level, const LightOptions& options,
                              const Progress& progress) {
    const LightData data(scene, frames, saturation_level, options);
    LightEstimate estimate = data.start_estimate();
    if (!data.problem.empty()) return estimate;
    const ScanSamples& samples = data.samples;
    LightFit fit(data.world, samples, data.reference, data.opaque_mask, data.see_through_mask,
                 options.seed);
    if (!options.known_lights.empty()) {
        use_known_lights(fit, options.known_lights, estimate);
        progress.update(1.0);
        return estimate;
    }
    progress.update(0.15, "searching the hemisphere");

    LightSet set;
    if (options.start && !options.start->empty()) {
        const LightSet start = from_lights(*options.start, samples.reference_point);
        const RefineOptions refine =
            options.keep_start ? RefineOptions{.max_evaluations = 60, .keep_geometry = true}
                               : RefineOptions{.max_evaluations = 160,
                                               .step_rad = 0.03,
                                               .keep_distances = has_distant(fit, start)};
        set = refine_lights(fit, start, refine);
    } else {
        set = find_lights(fit, options, estimate, progress);
    }
    progress.update(0.75, "near or distant");
    std::vector<char> is_distant(set.lights.size(), 0);
    for (std::size_t k = 0; k < set.lights.size(); ++k)
        is_distant[k] = options.keep_start ? has_distant(fit, {{set.lights[k]}, {}})
                                           : !keep_nearer_if_evident(fit, set, k);
    progress.update(0.85, "strength and doubt of the lights");

    estimate.error_refined = set.score.cost;
    estimate.residual_rms = set.score.residual_rms;
    estimate.outcome = Outcome::Converged;
    for (std::size_t k = 0; k < set.lights.size(); ++k) {
        estimate.lights.push_back(with_deviations(fit, set, k, is_distant[k] != 0));
        const FittedLight& fitted = estimate.lights.back();
        if (fitted.outcome == Outcome::Converged) continue;
        estimate.outcome = fitted.outcome;
        estimate.reason = fitted.reason;
    }
    fit_channels(fit, set, estimate);
    if (frames.size() < 2) {
        estimate.outcome = Outcome::NotIdentifiable;
        estimate.reason = "only one view: no second picture checks geometry and light";
        for (FittedLight& fitted : estimate.lights) {
            fitted.outcome = estimate.outcome;
            fitted.reason = estimate.reason;
        }
    }
    progress.update(1.0);
    return estimate;
}

double elevation_deg(const LightEstimate& estimate, const Vec3& light_position_m) {
    const Vec3 d = (light_position_m - estimate.reference_point_m).normalized();
    return degrees(std::asin(std::clamp(d.dot(estimate.plane.normal), -1.0, 1.0)));
}

DirectionalLight as_directional(const FittedLight& light, const Vec3& reference_point_m) {
    const Vec3 d = reference_point_m - light.light.position_m;
    return {d.normalized(), light.light.intensity_w_per_sr / static_cast<float>(d.squaredNorm())};
}

std::vector<Light> to_lights(const LightEstimate& estimate) {
    std::vector<Light> lights;
    for (const FittedLight& fitted : estimate.lights) {
        if (fitted.is_distant) {
            lights.push_back(as_directional(fitted, estimate.reference_point_m));
        } else {
            lights.push_back(fitted.light);
        }
    }
    return lights;
}

}  // namespace vitrine
