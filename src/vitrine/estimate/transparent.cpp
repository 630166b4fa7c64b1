#include "estimate/transparent.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "estimate/model_error.h"
#include "estimate/vessel.h"
#include "math/optimise.h"
#include "math/statistics.h"
#include "optics/fresnel.h"
#include "render/estimation_refraction.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr double kCap = 0.25;  // of the bright level: beyond, a pixel is simply wrong
constexpr int kIorGrid = 21;   // step 0.04: no basin of the objective is narrower
constexpr int kBootstrapRounds = 40;
constexpr double kMinExplained = 0.15;
constexpr int kRays = 2;  // side of the square of rays in a pixel

Rgb environment(const EstimationScene& scene, const Vec3f& origin, const Vec3f& direction,
                const Rgb& ambient) {
    const Hit hit = scene.accel().closest({origin, direction, 1e-4f, 1e30f, kScanMask});
    const std::optional<Rgb> seen = scene.scan_radiance(hit, direction);
    return seen ? *seen : ambient;
}

/// One ray of a pixel.
template <typename Trace, typename TraceInner>
ThroughPixel predict_ray(const EstimationScene& scene, const FrameLookup& lookup, const Vec3f& eye,
                         const Vec3f& direction, const Rgb& ambient, const Trace& trace,
                         const TraceInner& trace_inner) {
    ThroughPixel result;
    const RefractedPath path = trace(eye, direction);
    if (!path.is_valid) return result;
    const Hit hit = scan_behind(scene, path, scene.offset_m());
    Rgb background = ambient;
    if (hit.is_hit()) {
        if (hit.normal.dot(path.exit_direction) >= 0.0f) return result;
        const Mesh& mesh = scene.mesh(hit.part);
        const std::optional<Rgb> seen =
            lookup.background({hit_point(mesh, hit), shading_normal(mesh, hit)}, -1);
        if (!seen) return result;
        background = *seen;
    }
    const RefractedPath inner = trace_inner(eye, direction);
    if (inner.is_valid) {
        result.inner =
            inner.transmittance * environment(scene, inner.exit, inner.exit_direction, ambient);
        result.inner_length_m = inner.length_m;
    }
    result.transmitted = path.transmittance * background;
    result.reflected =
        path.entry_reflectance *
        environment(scene, path.entry, reflect(-direction, path.entry_normal), ambient);
    result.length_m = path.length_m;
    result.is_valid = true;
    return result;
}

/// Mean over a square of rays in every pixel: glass turns a pixel into a wide patch of what lies
/// behind, or a small one.
template <typename Trace, typename TraceInner>
std::vector<ThroughPixel> predict(const EstimationScene& scene, const FrameLookup& lookup,
                                  const std::vector<ObjectPixel>& pixels, const Rgb& ambient,
                                  const Trace& trace, const TraceInner& trace_inner) {
    std::vector<ThroughPixel> result(pixels.size());
    parallel_for(pixels.size(), 16, [&](std::size_t i) {
        const ObjectPixel& pixel = pixels[i];
        const Camera& camera = lookup.cameras()[static_cast<std::size_t>(pixel.frame)];
        ThroughPixel sum;
        int valid = 0;
        for (int k = 0; k < kRays * kRays; ++k) {
            const double du = (k % kRays + 0.5) / kRays - 0.5;
            const double dv = (k / kRays + 0.5) / kRays - 0.5;
            const Vec3f direction = camera.ray_in_world(pixel.u + du, pixel.v + dv).cast<float>();
            const ThroughPixel ray =
                predict_ray(scene, lookup, pixel.eye, direction, ambient, trace, trace_inner);
            if (!ray.is_valid) continue;
            ++valid;
            sum.transmitted += ray.transmitted;
            sum.reflected += ray.reflected;
            sum.inner += ray.inner;
            sum.length_m += ray.length_m;
            sum.inner_length_m += ray.inner_length_m;
        }
        if (2 * valid <= kRays * kRays) return;
        const float share = 1.0f / static_cast<float>(valid);
        sum.transmitted *= share;
        sum.reflected *= share;
        sum.inner *= share;
        sum.length_m *= share;
        sum.inner_length_m *= share;
        sum.is_valid = true;
        result[i] = sum;
    });
    return result;
}

double pixel_cost(const ThroughPixel& t, const ObjectPixel& p, const Rgb& sigma_a, double bright) {
    const Rgb model = t.transmitted * (-sigma_a * t.length_m).exp() + t.side_light(sigma_a);
    return std::min(static_cast<double>((model - p.radiance).abs().mean()) / bright, kCap);
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

std::vector<ThroughPixel> look_through(const EstimationScene& scene, const FrameLookup& lookup,
                                       int object, const std::vector<ObjectPixel>& pixels,
                                       double ior, const Rgb& ambient) {
    return predict(
        scene, lookup, pixels, ambient,
        [&](const Vec3f& eye, const Vec3f& direction) {
            return refract_through(scene, object, eye, direction, static_cast<float>(ior));
        },
        [&](const Vec3f& eye, const Vec3f& direction) {
            return refract_through(scene, object, eye, direction, static_cast<float>(ior), 1);
        });
}

std::vector<ThroughPixel> look_through_vessel(const EstimationScene& scene,
                                              const FrameLookup& lookup, int object,
                                              const std::vector<ObjectPixel>& pixels, double ior,
                                              double wall_m, const Rgb& ambient) {
    const Vessel vessel(scene.mesh(scene.part_of_object(object)), wall_m);
    return predict(
        scene, lookup, pixels, ambient,
        [&](const Vec3f& eye, const Vec3f& direction) {
            return vessel.pass(eye, direction, static_cast<float>(ior));
        },
        [](const Vec3f&, const Vec3f&) { return RefractedPath{}; });
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
    const auto evaluate = [&](double ior) {
        predicted.push_back(look_through(scene, lookup, object, pixels, ior, options.ambient));
        trial.push_back(ior);
        const double cost =
            through_cost(predicted.back(), pixels, sigma_for(predicted.back(), {}), bright, {});
        greatest = std::max(greatest, cost);
        return cost;
    };
    double best_ior = 0.0;
    if (options.known_ior) {
        best_ior = *options.known_ior;
        evaluate(best_ior);
    } else {
        Minimum1d minimum =
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
    const std::vector<ThroughPixel> best =
        look_through(scene, lookup, object, pixels, best_ior, options.ambient);
    fit.ior.value = best_ior;
    fit.sigma_a_per_m.value = sigma_for(best, {});
    fit.cost = through_cost(best, pixels, fit.sigma_a_per_m.value, bright, {});
    fit.explained = share_explained(best);
    fit.ior.residual_rms = fit.sigma_a_per_m.residual_rms = fit.cost;

    // Between the trials around the best, far enough apart to be more than noise.
    const auto absorption_slope = [&]() {
        constexpr double kNear = 0.01;
        std::size_t below = trial.size(), above = trial.size();
        for (std::size_t k = 0; k < trial.size(); ++k) {
            if (trial[k] < best_ior - kNear && (below == trial.size() || trial[k] > trial[below]))
                below = k;
            if (trial[k] > best_ior + kNear && (above == trial.size() || trial[k] < trial[above]))
                above = k;
        }
        if (below == trial.size() || above == trial.size()) return Rgb(Rgb::Zero());
        return Rgb((sigma_for(predicted[above], {}) - sigma_for(predicted[below], {})) /
                   static_cast<float>(trial[above] - trial[below]));
    };

    // Bootstrap over views among the trials already traced, with a parabola between them.
    std::vector<double> iors;
    std::array<std::vector<double>, 3> sigmas;
    const int views = static_cast<int>(lookup.frames().size());
    std::vector<std::size_t> order(trial.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return trial[a] < trial[b]; });
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
    add_model_error(fit, options, absorption_slope());
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
