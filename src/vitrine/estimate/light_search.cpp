#include "estimate/light_search.h"

#include "estimate/lights.h"
#include "math/optimise.h"
#include "math/sampling.h"

#include <Eigen/Eigenvalues>

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
// Deviation of a logarithm that nothing shows: a factor of two, more or less.
constexpr double kUnknownLog = 0.7;
constexpr int kDiscSamples = 16;       // of lamps that losses are compared for
constexpr double kBoundMargin = 1.05;  // this near its end of the range, a light lies at it

Vec3 tilted(const Vec3& direction, double x, double y) {
    const Frame frame(direction.cast<float>());
    return (direction + std::tan(x) * frame.tangent.cast<double>() +
            std::tan(y) * frame.bitangent.cast<double>())
        .normalized();
}

// Two angles, log distance, log radius of one light.
constexpr int kCount = 4;
using Vector = Eigen::Matrix<double, kCount, 1>;
using Matrix = Eigen::Matrix<double, kCount, kCount>;

bool is_flat(const Matrix& hessian, int a) {
    constexpr double kFlat = 1e-3;  // of a loss in [0, 1]
    return hessian(a, a) < kFlat;
}

/// Inverse of the curvature. Unlike quantities are scaled to unit curvature first; what does not
/// curve at all is left out (zeros), and no combination is taken to be vaguer than 1 / kMinShare:
/// less is the noise of second differences.
Matrix inverse_of(const Matrix& hessian) {
    constexpr double kMinShare = 0.15;
    Vector scale = Vector::Zero();
    for (int a = 0; a < kCount; ++a)
        if (!is_flat(hessian, a)) scale[a] = 1.0 / std::sqrt(hessian(a, a));
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(scale.asDiagonal() * hessian *
                                                       scale.asDiagonal());
    Matrix inverse = Matrix::Zero();
    for (int a = 0; a < kCount; ++a) {
        const Vector v = scale.cwiseProduct(solver.eigenvectors().col(a));
        inverse += v * v.transpose() / std::max(solver.eigenvalues()[a], kMinShare);
    }
    return inverse;
}

}  // namespace

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

LightDeviation light_deviation(const LightFit& fit, const LightSet& set, std::size_t k) {
    // Shadows' borders cross samples one by one, so second differences are noisy like one over the
    // square of the step: with half of these the curvature is often singular by chance, and
    // deviations come out several times too large.
    const Vector steps(0.04, 0.04, 0.16, 0.6);
    std::vector<double> weight;
    const auto evaluate = [&](const Vector& x, std::vector<double>& loss) {
        std::vector<PolarLight> lights = set.lights;
        lights[k].direction = tilted(lights[k].direction, x[0], x[1]);
        lights[k].weight *= std::exp(2.0 * x[2]);
        lights[k].distance_m *= std::exp(x[2]);
        lights[k].radius_m *= std::exp(x[2] + x[3]);
        const LightColumns columns = columns_of(fit, lights, kDiscSamples, 1);
        const LightScore score = fit.score_at(columns, 1, kLuminance, set.score.ambient_ratio);
        fit.losses(columns, 1, kLuminance, score, loss, weight);
        double sum = 0.0, total = 1e-12;
        for (std::size_t i = 0; i < loss.size(); ++i) {
            loss[i] *= weight[i];
            sum += loss[i];
            total += weight[i];
        }
        return sum / total;
    };
    std::vector<double> plus, minus, unused;
    const double centre = evaluate(Vector::Zero(), unused);
    double total_weight = 0.0;
    for (const double w : weight) total_weight += w;

    Matrix hessian = Matrix::Zero();
    std::map<int, Vector> block_sum;
    Vector up, down;
    for (int a = 0; a < kCount; ++a) {
        const Vector step = steps[a] * Vector::Unit(a);
        up[a] = evaluate(step, plus);
        down[a] = evaluate(-step, minus);
        hessian(a, a) = (up[a] + down[a] - 2.0 * centre) / (steps[a] * steps[a]);
        for (std::size_t i = 0; i < plus.size(); ++i) {
            auto [entry, is_new] = block_sum.try_emplace(fit.samples().block[i], Vector::Zero());
            entry->second[a] += (plus[i] - minus[i]) / (2.0 * steps[a]);
        }
    }
    for (int a = 0; a < kCount; ++a) {
        for (int b = a + 1; b < kCount; ++b) {
            const Vector step = steps[a] * Vector::Unit(a) + steps[b] * Vector::Unit(b);
            const double both = evaluate(step, unused) + evaluate(-step, unused);
            hessian(a, b) = hessian(b, a) =
                (both - up[a] - down[a] - up[b] - down[b] + 2.0 * centre) /
                (2.0 * steps[a] * steps[b]);
        }
    }
    LightDeviation deviation;
    const PolarLight& light = set.lights[k];
    deviation.is_at_bound =
        light.distance_m < kBoundMargin * kMinDistancePerRadius * fit.samples().scene_radius_m ||
        light.direction.dot(fit.samples().plane.normal) < kBoundMargin * kMinElevationSine;
    deviation.is_identifiable = !is_flat(hessian, 0) && !is_flat(hessian, 1);
    Matrix meat = Matrix::Zero();
    for (const auto& [block, sum] : block_sum) {
        const Vector s = sum / total_weight;
        meat += s * s.transpose();
    }
    // Before any picture distance and radius are known within a factor or two, which keeps a
    // penumbra that says nothing of the radius from making the direction vague as well. The loss
    // becomes a likelihood by the scale at which curvature and scatter of the angles agree.
    const double scale = (hessian(0, 0) + hessian(1, 1)) / std::max(meat(0, 0) + meat(1, 1), 1e-30);
    if (deviation.is_identifiable)
        for (const int a : {2, 3}) {
            const double prior = 1.0 / (scale * kUnknownLog * kUnknownLog);
            hessian(a, a) = std::max(hessian(a, a), 0.0) + prior;
            meat(a, a) += prior / scale;
        }
    const Matrix inverse = inverse_of(hessian);
    const Matrix covariance = inverse * meat * inverse;
    const auto deviation_of = [&](int a) {
        return deviation.is_identifiable ? std::sqrt(std::max(0.0, covariance(a, a))) : kUnknownLog;
    };
    deviation.direction_rad = std::sqrt(std::max(0.0, 0.5 * (covariance(0, 0) + covariance(1, 1))));
    deviation.log_distance = deviation_of(2);
    deviation.log_radius = deviation_of(3);
    return deviation;
}

}  // namespace vitrine
