#include "estimate/lights.h"

#include "estimate/find_lights.h"
#include "estimate/known_lights.h"
#include "estimate/light_data.h"
#include "estimate/light_outcome.h"
#include "estimate/light_search.h"
#include "math/optimise.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr double kNearPerRadius = 3.0;        // radii of the scene: a lamp over a table
constexpr double kMinDistanceEvidence = 2.0;  // deviations; less, and it may be the sun

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
                    return fit.score_near(combined(x), 1, channel, set.score.ambient_ratio).cost;
                },
                share, std::vector<double>(share.size(), 0.1), {.max_evaluations = 40});
            share = best.x;
        }
        const LightScore score =
            fit.score_near(combined(share), 1, channel, set.score.ambient_ratio);
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
    const bool is_near = evidence_over(fit, near, far) >= kMinDistanceEvidence;
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
        const FoundLights found = find_lights(fit, options, progress.part(0.15, 0.75));
        set = found.set;
        estimate.error_initial = found.grid_cost;
        estimate.grid_direction = found.grid_direction;
        estimate.rival = found.rival;
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
    const std::vector<LightDeviation> deviations = light_deviations(fit, set);
    for (std::size_t k = 0; k < set.lights.size(); ++k) {
        estimate.lights.push_back(with_deviations(fit, set, k, deviations[k], is_distant[k] != 0));
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
    if (const std::string rival = estimate.rival; !rival.empty()) doubt_by_rival(estimate, rival);
    progress.update(1.0);
    return estimate;
}

void doubt_by_rival(LightEstimate& estimate, const std::string& rival) {
    estimate.rival = rival;
    if (rival.empty()) return;
    for (FittedLight& fitted : estimate.lights) {
        if (fitted.outcome != Outcome::Converged) continue;
        fitted.outcome = Outcome::Ambiguous;
        fitted.reason = rival;
    }
    if (estimate.outcome != Outcome::Converged) return;
    estimate.outcome = Outcome::Ambiguous;
    estimate.reason = rival;
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
