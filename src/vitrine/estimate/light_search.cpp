#include "estimate/light_search.h"

#include "estimate/lights.h"
#include "math/optimise.h"
#include "math/sampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace vitrine {

namespace {

constexpr double kMinElevationSine = 0.05;  // lower lights graze the table and light nothing
// Radius of the lamp at one metre before anything is known: a desk lamp.
constexpr double kFirstRadiusPerMetre = 0.04;
constexpr double kMinDistancePerRadius = 0.8, kMaxDistancePerRadius = 12.0;
constexpr double kPenalty = 10.0;
constexpr int kDiscSamples = 16;  // of lamps that losses are compared for

}  // namespace

Vec3 tilted(const Vec3& direction, double x, double y) {
    const Frame frame(direction.cast<float>());
    return (direction + std::tan(x) * frame.tangent.cast<double>() +
            std::tan(y) * frame.bitangent.cast<double>())
        .normalized();
}

void sort_by_cost(std::vector<LightSet>& sets) {
    std::stable_sort(sets.begin(), sets.end(), [](const LightSet& a, const LightSet& b) {
        return a.score.cost < b.score.cost;
    });
}

HemisphereGrid make_hemisphere(const ScanSamples& samples, int count) {
    HemisphereGrid grid;
    const Frame frame(samples.plane.normal.cast<float>());
    const double golden = kPi * (3.0 - std::sqrt(5.0));
    for (int i = 0; i < count; ++i) {
        const double z =
            kMinElevationSine + (1.0 - kMinElevationSine) * (static_cast<double>(i) + 0.5) / count;
        const double r = std::sqrt(1.0 - z * z), angle = golden * i;
        const Vec3f local(static_cast<float>(r * std::cos(angle)),
                          static_cast<float>(r * std::sin(angle)), static_cast<float>(z));
        grid.directions.push_back(frame.to_world(local).cast<double>().normalized());
    }
    const double diameter = 2.0 * samples.scene_radius_m;
    grid.distances_m = {diameter, 1.8 * diameter, kDistantPerRadius * samples.scene_radius_m};
    return grid;
}

TrialLight to_trial(const PolarLight& light, const Vec3& reference_point_m) {
    return {reference_point_m + light.distance_m * light.direction, -light.direction,
            light.radius_m};
}

LightColumns columns_of(const LightFit& fit, std::span<const PolarLight> lights, int disc_samples,
                        int stride) {
    LightColumns columns;
    for (const PolarLight& light : lights)
        columns.add(
            fit.column(to_trial(light, fit.samples().reference_point), disc_samples, stride),
            light.weight);
    return columns;
}

std::vector<LightSet> search_single(const LightFit& fit, const HemisphereGrid& grid, int stride) {
    std::vector<LightSet> sets;
    for (const Vec3& direction : grid.directions) {
        LightSet best;
        best.score.cost = 2.0;
        for (const double distance : grid.distances_m) {
            LightSet set;
            set.lights = {{direction, distance, kFirstRadiusPerMetre * distance, 1.0}};
            set.score = fit.score(columns_of(fit, set.lights, 8, stride), stride, kLuminance);
            if (set.score.cost < best.score.cost) best = set;
        }
        sets.push_back(best);
    }
    sort_by_cost(sets);
    return sets;
}

std::vector<LightSet> search_pairs(const LightFit& fit, const HemisphereGrid& grid,
                                   std::span<const LightSet> firsts, int stride) {
    constexpr double kMinSeparationCos = 0.906;  // 25 degrees: closer ones pass for one large light
    constexpr std::array<double, 3> kWeights = {0.3, 0.6, 1.2};
    const double distance = grid.distances_m.front();
    std::vector<DirectColumn> seconds;
    for (const Vec3& direction : grid.directions)
        seconds.push_back(
            fit.column(to_trial({direction, distance, kFirstRadiusPerMetre * distance, 1.0},
                                fit.samples().reference_point),
                       8, stride));
    std::vector<LightSet> sets;
    for (const LightSet& first : firsts) {
        const LightColumns base = columns_of(fit, first.lights, 8, stride);
        for (std::size_t k = 0; k < seconds.size(); ++k) {
            const bool is_apart =
                std::all_of(first.lights.begin(), first.lights.end(), [&](const PolarLight& light) {
                    return light.direction.dot(grid.directions[k]) < kMinSeparationCos;
                });
            if (!is_apart) continue;
            for (const double w : kWeights) {
                // Weights are of irradiance at the reference point: fair to any distance.
                const double weight = w * std::pow(distance / first.lights[0].distance_m, 2);
                LightSet set = first;
                set.lights.push_back(
                    {grid.directions[k], distance, kFirstRadiusPerMetre * distance, weight});
                LightColumns columns = base;
                columns.add(seconds[k], weight);
                set.score = fit.score_at(columns, stride, kLuminance, first.score.ambient_ratio);
                sets.push_back(std::move(set));
            }
        }
    }
    sort_by_cost(sets);
    return sets;
}

LightSet refine_lights(const LightFit& fit, const LightSet& start, const RefineOptions& options) {
    constexpr std::size_t kPerLight = 5;  // two angles, log distance, log radius, log weight
    std::vector<double> x0, steps;
    for (std::size_t k = 0; k < start.lights.size(); ++k) {
        x0.insert(x0.end(), kPerLight, 0.0);
        const double step = options.keep_geometry ? 0.0 : options.step_rad;
        const double to_or_fro = options.keep_distances ? 0.0 : 1.5 * step;
        steps.insert(steps.end(), {step, step, to_or_fro, options.refine_radius ? 4.0 * step : 0.0,
                                   k == 0 ? 0.0 : std::max(0.2, 2.0 * step)});
    }
    const auto unpack = [&](const std::vector<double>& x) {
        std::vector<PolarLight> lights = start.lights;
        for (std::size_t k = 0; k < lights.size(); ++k) {
            const double* p = &x[k * kPerLight];
            lights[k].direction = tilted(start.lights[k].direction, p[0], p[1]);
            lights[k].distance_m *= std::exp(p[2]);
            lights[k].radius_m *= std::exp(p[2] + p[3]);
            // Irradiance, not intensity, is what the data fix: keep it while distance changes.
            lights[k].weight *= std::exp(p[4] + 2.0 * (p[2] - x[2]));
        }
        return lights;
    };
    const double radius = fit.samples().scene_radius_m;
    const Vec3& up = fit.samples().plane.normal;
    const auto cost = [&](const std::vector<double>& x) {
        const std::vector<PolarLight> lights = unpack(x);
        double penalty = 0.0;
        for (const PolarLight& light : lights) {
            if (options.keep_geometry) break;  // wherever they stand
            if (light.distance_m < kMinDistancePerRadius * radius ||
                (!options.keep_distances && light.distance_m > kMaxDistancePerRadius * radius) ||
                light.direction.dot(up) < kMinElevationSine ||
                light.radius_m > 0.35 * light.distance_m || light.radius_m < 1e-4)
                penalty += kPenalty;
        }
        if (penalty > 0.0) return penalty;
        return fit
            .score(columns_of(fit, lights, options.disc_samples, options.stride), options.stride,
                   kLuminance)
            .cost;
    };
    const MinimumNd best = minimise_nelder_mead(
        cost, x0, steps,
        {.max_evaluations = options.max_evaluations, .tolerance = 2e-5, .min_size = 0.01});
    LightSet result;
    result.lights = unpack(best.x);
    result.score = fit.score(columns_of(fit, result.lights, options.disc_samples, options.stride),
                             options.stride, kLuminance);
    return result;
}

bool is_at_bound(const LightFit& fit, const PolarLight& light) {
    constexpr double kBoundMargin = 1.05;
    return light.distance_m < kBoundMargin * kMinDistancePerRadius * fit.samples().scene_radius_m ||
           light.direction.dot(fit.samples().plane.normal) < kBoundMargin * kMinElevationSine;
}

bool has_distant(const LightFit& fit, const LightSet& set) {
    return std::any_of(set.lights.begin(), set.lights.end(), [&](const PolarLight& light) {
        return light.distance_m > kMaxDistancePerRadius * fit.samples().scene_radius_m;
    });
}

LightSet at_distance(const LightFit& fit, const LightSet& set, std::size_t k, double per_radius) {
    LightSet start = set;
    PolarLight& light = start.lights[k];
    const double scale = per_radius * fit.samples().scene_radius_m / light.distance_m;
    light.distance_m *= scale;
    light.radius_m *= scale;  // the same penumbrae
    if (k > 0) {
        light.weight *= scale * scale;
    } else {
        for (std::size_t i = 1; i < start.lights.size(); ++i)
            start.lights[i].weight /= scale * scale;
    }
    const bool is_far = has_distant(fit, start);
    return refine_lights(fit, start,
                         {.max_evaluations = is_far ? 60 : 140,
                          .step_rad = is_far ? 0.02 : 0.06,
                          .keep_distances = is_far});
}

double evidence_over(const LightFit& fit, const LightSet& better, const LightSet& worse) {
    std::vector<double> better_loss, worse_loss, weight;
    fit.losses(columns_of(fit, better.lights, kDiscSamples, 1), 1, kLuminance, better.score,
               better_loss, weight);
    fit.losses(columns_of(fit, worse.lights, kDiscSamples, 1), 1, kLuminance, worse.score,
               worse_loss, weight);
    std::map<int, double> block_sum;
    for (std::size_t i = 0; i < weight.size(); ++i)
        block_sum[fit.samples().block[i]] += weight[i] * (worse_loss[i] - better_loss[i]);
    double sum = 0.0, square = 0.0;
    for (const auto& [block, value] : block_sum) {
        sum += value;
        square += value * value;
    }
    return square > 0.0 ? sum / std::sqrt(square) : 0.0;
}

}  // namespace vitrine
