// The fit of a Ward surface to the pixels of a SpecularModel.
#include "base/log.h"
#include "base/rng.h"
#include "estimate/light_combinations.h"
#include "estimate/model_error.h"
#include "estimate/specular.h"
#include "math/optimise.h"
#include "math/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vitrine {

namespace {

constexpr double kCap = 0.25;        // of the bright level, as for clear objects
constexpr float kMinViewCos = 0.2f;  // flatter: normals of a hull are wrong there
constexpr int kIrlsRounds = 6;
constexpr int kBootstrapRounds = 24;
// Two roughnesses instead of one must lower the objective by this share and differ by this factor.
constexpr double kBrushedGain = 0.1;
constexpr double kMinBrushedRatio = 1.25;
constexpr double kBrushedProbe = 1.5;  // factor of the first look at two roughnesses
constexpr double kBrushedHint = 0.02;  // share it must win for a search to be worth its time
constexpr double kMinLitShare = 0.02;  // of the pixels: less shows no lobe

enum class Use : std::uint8_t { None, Equal, AtLeast };

/// What pixel and channel say: nothing (too flat, next to a clipped one), their value, or "at
/// least".
Use use_of(const ObjectPixel& pixel, int channel) {
    if (-pixel.direction.dot(pixel.surface.normal) <= kMinViewCos) return Use::None;
    if (!pixel.is_clipped) return Use::Equal;
    return pixel.is_at_least[static_cast<std::size_t>(channel)] ? Use::AtLeast : Use::None;
}

double residual(Use use, double model, double seen) {
    return use == Use::AtLeast ? std::min(0.0, model - seen) : model - seen;
}

struct Search {
    WardLobe lobe;
    double objective = 2.0;
    bool is_at_bound = false;
};

Search search_isotropic(const SpecularModel& model, double bright, const SpecularOptions& options) {
    Search best;
    for (const WardForm form : {WardForm::Ward, WardForm::Duer}) {
        const Minimum1d minimum = minimise_grid_golden(
            [&](double log_sigma) {
                const double sigma = std::exp(log_sigma);
                return fit_lobe(model, model.columns({sigma, sigma, form}), bright, true).objective;
            },
            std::log(options.sigma_min), std::log(options.sigma_max), options.sigma_grid, 8);
        if (minimum.value < best.objective) {
            const double sigma = std::exp(minimum.x);
            best = {{sigma, sigma, form}, minimum.value, minimum.is_at_bound};
        }
    }
    return best;
}

/// Two roughnesses when one look at them promises something and the data then insist.
Search search_brushed(const SpecularModel& model, double bright, const SpecularOptions& options,
                      const Search& isotropic) {
    const auto objective = [&](double log_x, double log_y) {
        const double low = std::log(options.sigma_min), high = std::log(options.sigma_max);
        if (std::min(log_x, log_y) < low || std::max(log_x, log_y) > high) return 2.0;
        return fit_lobe(model,
                        model.columns({std::exp(log_x), std::exp(log_y), isotropic.lobe.form}),
                        bright, true)
            .objective;
    };
    // One roughness for a brushed surface may be anywhere: look around it and at three others.
    const double step = std::log(kBrushedProbe);
    double least = 2.0;
    std::vector<double> start = {0.0, 0.0};
    for (const double sigma : {isotropic.lobe.sigma_x, 0.06, 0.12, 0.24})
        for (const double side : {-step, step}) {
            const std::vector<double> probe = {std::log(sigma) + side, std::log(sigma) - side};
            const double value = objective(probe[0], probe[1]);
            if (value >= least) continue;
            least = value;
            start = probe;
        }
    if (least > (1.0 - kBrushedHint) * isotropic.objective) return isotropic;
    const MinimumNd best = minimise_nelder_mead(
        [&](const std::vector<double>& x) { return objective(x[0], x[1]); }, start, {0.3, 0.3},
        {.max_evaluations = 50, .tolerance = 1e-4, .min_size = 0.02});
    const double x = std::exp(best.x[0]), y = std::exp(best.x[1]);
    if (best.value > (1.0 - kBrushedGain) * isotropic.objective ||
        std::max(x / y, y / x) < kMinBrushedRatio)
        return isotropic;
    return {{x, y, isotropic.lobe.form}, best.value, false};
}

/// Mean square turn of the normal within a pixel that sees the lobe, rad^2, the weighted median
/// over pixels: a pixel shows the mean over its square, the model the middle.
double variance_within_pixels(const std::vector<ObjectPixel>& pixels,
                              const SpecularColumns& columns) {
    std::vector<double> variance, weight;
    double total = 0.0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        variance.push_back(pixels[i].normal_variance);
        weight.push_back(luminance(columns.lobe[i]));
        total += weight.back();
    }
    return total > 0.0 ? weighted_median(variance, weight) : 0.0;
}

/// The lobe seen is the true one widened by normals that turn (`variance`, rad^2, both axes).
void correct_for_normals(WardFit& fit, const WardLobe& lobe, bool is_at_bound, double variance,
                         double within) {
    // Not below this share of the square seen: what is left would be a difference of errors.
    constexpr double kMinShare = 0.5;
    const auto corrected = [variance](double sigma) {
        return std::sqrt(std::max(sigma * sigma - variance, kMinShare * sigma * sigma));
    };
    fit.ward.form = lobe.form;
    fit.ward.sigma_x = corrected(lobe.sigma_x);
    fit.ward.sigma_y = corrected(lobe.sigma_y);
    fit.sigma.value = std::sqrt(fit.ward.sigma_x * fit.ward.sigma_y);
    fit.sigma.outcome = Outcome::Converged;
    const double square = lobe.sigma_x * lobe.sigma_y;
    if (variance > kMinShare * square || within > square) {
        fit.sigma.outcome = Outcome::NotIdentifiable;
        fit.sigma.reason =
            "normals turn more, over the hull or within a pixel, than the lobe is wide";
    } else if (is_at_bound) {
        fit.sigma.outcome = Outcome::AtBound;
        fit.sigma.reason = "the best roughness lies at the end of the range";
    }
}

/// Spread over resampled views, among five neighbours of the best roughness.
void set_deviations(const SpecularModel& model, const WardLobe& lobe, double bright, WardFit& fit) {
    constexpr std::array<double, 5> kFactors = {0.8, 0.9, 1.0, 1.12, 1.25};
    std::vector<SpecularColumns> near;
    for (const double factor : kFactors)
        near.push_back(model.columns({lobe.sigma_x * factor, lobe.sigma_y * factor, lobe.form}));
    std::vector<double> sigmas;
    std::array<std::vector<double>, 6> rho;
    int view_count = 0;
    for (const ObjectPixel& p : model.pixels()) view_count = std::max(view_count, p.frame + 1);
    for (int round = 0; round < kBootstrapRounds; ++round) {
        Rng rng(stream_key(0xb005u, round));
        std::vector<int> drawn(static_cast<std::size_t>(view_count), 0);
        for (int k = 0; k < view_count; ++k)
            ++drawn[rng.next_index(static_cast<std::uint32_t>(view_count))];
        std::vector<int> count;
        for (const ObjectPixel& p : model.pixels())
            count.push_back(drawn[static_cast<std::size_t>(p.frame)]);
        LobeFit least;
        least.objective = 2.0;
        double at = fit.sigma.value;
        for (std::size_t k = 0; k < near.size(); ++k) {
            const LobeFit trial = fit_lobe(model, near[k], bright, true, count);
            if (trial.objective < least.objective) {
                least = trial;
                at = fit.sigma.value * kFactors[k];
            }
        }
        sigmas.push_back(at);
        for (int c = 0; c < 3; ++c) {
            rho[static_cast<std::size_t>(c)].push_back(least.rho_d[c]);
            rho[static_cast<std::size_t>(3 + c)].push_back(least.rho_s[c]);
        }
    }
    fit.sigma.stddev = standard_deviation(sigmas);
    for (int c = 0; c < 3; ++c) {
        fit.stddev_rho_d[c] =
            static_cast<float>(standard_deviation(rho[static_cast<std::size_t>(c)]));
        fit.stddev_rho_s[c] =
            static_cast<float>(standard_deviation(rho[static_cast<std::size_t>(3 + c)]));
    }
}

}  // namespace

LobeFit fit_lobe(const SpecularModel& model, const SpecularColumns& columns, double bright,
                 bool with_lobe, const std::vector<int>& count, std::vector<Rgbd>* weight) {
    LobeFit result;
    const std::vector<ObjectPixel>& pixels = model.pixels();
    const double delta = 0.02 * bright;  // residuals below this count as squares
    if (weight) weight->assign(pixels.size(), Rgbd::Zero());
    const auto times = [&](std::size_t i) { return count.empty() ? 1.0 : count[i]; };
    for (int c = 0; c < 3; ++c) {
        double d = 0.0, s = 0.0;
        for (int round = 0; round < kIrlsRounds; ++round) {
            double aa = 0, aw = 0, ww = 0, as = 0, ws = 0;
            for (std::size_t i = 0; i < pixels.size(); ++i) {
                const Use use = use_of(pixels[i], c);
                // What only says "at least" comes in once there is a model that it can exceed.
                if (use == Use::None || (use == Use::AtLeast && round == 0)) continue;
                const double a = columns.diffuse[i][c], w = columns.lobe[i][c];
                const double l = pixels[i].radiance[c];
                double v = times(i);
                if (round > 0) {
                    const double r = residual(use, d * a + s * w, l);
                    v = use == Use::AtLeast && r == 0.0 ? 0.0
                                                        : v * delta / std::max(delta, std::abs(r));
                }
                if (weight && round + 1 == kIrlsRounds) (*weight)[i][c] = v;
                aa += v * a * a;
                aw += v * a * w;
                ww += v * w * w;
                as += v * a * l;
                ws += v * w * l;
            }
            const TwoColumnFit fit = with_lobe ? fit_two_columns(aa, aw, ww, as, ws, 0.0)
                                               : fit_two_columns(aa, 0.0, 0.0, as, 0.0, 0.0);
            d = fit.d;
            s = fit.s;
        }
        result.rho_d[c] = static_cast<float>(d);
        result.rho_s[c] = static_cast<float>(s);
    }
    double sum = 0.0, total = 1e-12, sum_clipped = 0.0, total_clipped = 0.0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        double e = 0.0;
        int used = 0;
        for (int c = 0; c < 3; ++c) {
            const Use use = use_of(pixels[i], c);
            if (use == Use::None) continue;
            ++used;
            e += std::abs(residual(
                use, result.rho_d[c] * columns.diffuse[i][c] + result.rho_s[c] * columns.lobe[i][c],
                pixels[i].radiance[c]));
        }
        if (used == 0) continue;
        const double share = std::min(e / (used * bright), kCap);
        (pixels[i].is_clipped ? sum_clipped : sum) += times(i) * share;
        (pixels[i].is_clipped ? total_clipped : total) += times(i);
    }
    result.cost = sum / total;
    result.objective = (sum + sum_clipped) / (total + total_clipped);
    return result;
}

WardFit fit_ward(const SpecularModel& model, double bright, const SpecularOptions& options) {
    WardFit fit;
    fit.pixel_count = static_cast<int>(model.pixels().size());
    if (model.pixels().empty()) {
        fit.sigma.reason = "no pixel shows this object";
        return fit;
    }
    for (const ObjectPixel& p : model.pixels())
        fit.censored_count += p.is_at_least[0] || p.is_at_least[1] || p.is_at_least[2];
    const Search isotropic = search_isotropic(model, bright, options);
    const Search found =
        options.may_be_brushed ? search_brushed(model, bright, options, isotropic) : isotropic;
    fit.cost_isotropic = isotropic.objective;
    const SpecularColumns columns = model.columns(found.lobe);
    std::vector<Rgbd> weight;
    const LobeFit best = fit_lobe(model, columns, bright, true, {}, &weight);
    fit.cost = best.cost;
    fit.cost_with_clipped = best.objective;
    fit.ward.rho_d = best.rho_d;
    fit.ward.rho_s = best.rho_s;
    const LobeFit diffuse = fit_lobe(model, columns, bright, false);
    fit.cost_diffuse = diffuse.cost;
    fit.cost_diffuse_with_clipped = diffuse.objective;
    fit.albedo = diffuse.rho_d.min(1.0f);
    fit.sigma.residual_rms = fit.cost;
    double lobe = 0.0, all = 1e-12;
    for (std::size_t i = 0; i < columns.lobe.size(); ++i) {
        const double s = luminance(Rgb(best.rho_s * columns.lobe[i]));
        lobe += s;
        all += s + luminance(Rgb(best.rho_d * columns.diffuse[i]));
    }
    fit.lobe_share = lobe / all;
    const double noise = 2.0 * options.normal_noise_rad * options.normal_noise_rad;
    const double within = variance_within_pixels(model.pixels(), columns);
    correct_for_normals(fit, found.lobe, found.is_at_bound, noise, within);
    if (model.lit_share() < kMinLitShare) {
        fit.sigma.outcome = Outcome::NotIdentifiable;
        fit.sigma.reason = "no lamp reaches what the pictures show of it: there is no highlight";
    }
    set_deviations(model, found.lobe, bright, fit);
    // The correction holds for the mean pixel: half of it is doubt.
    const double corrected_by =
        std::sqrt(found.lobe.sigma_x * found.lobe.sigma_y + within) - fit.sigma.value;
    fit.sigma.stddev = std::hypot(fit.sigma.stddev, 0.5 * corrected_by);
    log_debug(
        "ward: sigma {:.4f} +- {:.4f}, corrected by {:.4f}; rho_d {:.4f} +- {:.4f}, rho_s {:.4f} "
        "+- {:.4f}, lobe share {:.3f}, light {:.3f}, pixels {}, clipped {}",
        fit.sigma.value, fit.sigma.stddev, corrected_by, fit.ward.rho_d[1], fit.stddev_rho_d[1],
        fit.ward.rho_s[1], fit.stddev_rho_s[1], fit.lobe_share,
        model.light().stddev_irradiance_ratio, fit.pixel_count, fit.censored_count);
    add_model_error(fit, model.light().stddev_irradiance_ratio);
    if (options.is_certified) {
        WardBoundOptions bound;
        bound.sigma_min = options.sigma_min;
        bound.sigma_max = options.sigma_max;
        fit.certificate = certify_ward(model.problem(isotropic.lobe, weight), bound);
        log_info("certificate: sigma {:.4f} (fast search {:.4f}), {} nodes, gap {:.1e}",
                 fit.certificate->sigma, isotropic.lobe.sigma_x, fit.certificate->nodes,
                 fit.certificate->relative_gap());
    }
    return fit;
}

}  // namespace vitrine
