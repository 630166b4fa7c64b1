#include "estimate/specular.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/optimise.h"
#include "math/sampling.h"
#include "math/statistics.h"
#include "optics/fresnel.h"
#include "optics/ward.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vitrine {

namespace {

constexpr double kCap = 0.25;        // of the bright level, as for clear objects
constexpr float kMinViewCos = 0.2f;  // flatter: normals of a hull are wrong there
constexpr int kGatherRays = 48;
constexpr int kIrlsRounds = 6;
constexpr int kBootstrapRounds = 24;

/// Radiance per unit rho_s of the reflected surroundings, lamps left out. Half vectors follow the
/// lobe: tan^2 = -sigma^2 ln u; what remains of f cos / pdf is cos^3 h (h.o) times the cosines.
Rgb reflected_surroundings(const EstimationScene& scene, const ObjectPixel& pixel,
                           const KnownLight& light, double sigma, WardForm form, int samples,
                           std::uint32_t key) {
    const Frame frame(pixel.surface.normal);
    const Vec3f wo = frame.to_local(-pixel.direction);
    const Vec3f origin = pixel.surface.position + 2e-4f * pixel.surface.normal;
    Rgb sum = Rgb::Zero();
    for (int k = 0; k < samples; ++k) {
        const auto index = static_cast<std::uint32_t>(k);
        const float u = scrambled_sobol(index, 0, key), v = scrambled_sobol(index, 1, key);
        const float tan_h = static_cast<float>(sigma) * std::sqrt(-std::log(1.0f - u));
        const float cos_h = 1.0f / std::sqrt(1.0f + tan_h * tan_h);
        const float sin_h = tan_h * cos_h, phi = 2.0f * kPif * v;
        const Vec3f h(sin_h * std::cos(phi), sin_h * std::sin(phi), cos_h);
        const float h_dot_o = h.dot(wo);
        if (h_dot_o <= 0.0f) continue;
        const Vec3f wi = reflect(wo, h);
        if (wi.z() <= 0.0f) continue;
        const float cos_i = std::max(wi.z(), static_cast<float>(kWardMinCos));
        const float cos_o = std::max(wo.z(), static_cast<float>(kWardMinCos));
        const float weight = h_dot_o * cos_h * cos_h * cos_h *
                             (form == WardForm::Duer ? 1.0f / cos_o : std::sqrt(cos_i / cos_o));
        const Vec3f direction = frame.to_world(wi);
        const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, kAllMask});
        if (!hit.is_hit()) {
            sum += weight * light.ambient;
        } else if (const auto seen = scene.scan_radiance(hit, direction)) {
            sum += weight * *seen;
        }
    }
    return sum / static_cast<float>(samples);
}

/// Direct lobe of one lamp per unit rho_s, without its shadow.
Rgb direct_lobe(const ObjectPixel& pixel, const DiscLight& lamp, double sigma, WardForm form,
                int samples) {
    const Frame disc(lamp.normal.cast<float>());
    const Frame frame(pixel.surface.normal);
    const Vec3 wo = frame.to_local(-pixel.direction).cast<double>();
    double sum = 0.0;
    for (int k = 0; k < samples; ++k) {
        const float r = static_cast<float>(lamp.radius_m) *
                        std::sqrt((static_cast<float>(k) + 0.5f) / static_cast<float>(samples));
        const float angle = 2.39996323f * static_cast<float>(k);
        const Vec3f source = lamp.position_m.cast<float>() + r * (std::cos(angle) * disc.tangent +
                                                                  std::sin(angle) * disc.bitangent);
        const Vec3f to_light = source - pixel.surface.position;
        const float d2 = to_light.squaredNorm();
        const Vec3f direction = to_light / std::sqrt(d2);
        const float cos_l = -disc.normal.dot(direction);
        const Vec3 wi = frame.to_local(direction).cast<double>();
        if (cos_l <= 0.0f || wi.z() <= 0.0) continue;
        sum += ward_lobe(wo, wi, sigma, form == WardForm::Duer) * wi.z() * cos_l / d2;
    }
    return lamp.intensity_w_per_sr * static_cast<float>(sum / samples);
}

struct Linear {
    Rgb rho_d = Rgb::Zero(), rho_s = Rgb::Zero();
    double cost = 1.0;
};

/// Robust (towards L1) fit of S = rd a + rs w, both non-negative, per channel.
Linear solve(const SpecularModel& model, const SpecularColumns& columns, double bright,
             bool with_lobe, const std::vector<int>& count) {
    Linear result;
    const std::vector<ObjectPixel>& pixels = model.pixels();
    const double delta = 0.02 * bright;  // residuals below this count as squares
    std::vector<double> weight(pixels.size());
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const bool is_used = !pixels[i].is_clipped &&
                                 -pixels[i].direction.dot(pixels[i].surface.normal) > kMinViewCos;
            weight[i] = is_used ? (count.empty() ? 1.0 : count[i]) : 0.0;
        }
        double d = 0.0, s = 0.0;
        for (int round = 0; round < kIrlsRounds; ++round) {
            double aa = 0, aw = 0, ww = 0, as = 0, ws = 0;
            for (std::size_t i = 0; i < pixels.size(); ++i) {
                if (weight[i] == 0.0) continue;
                const double a = columns.diffuse[i][c], w = columns.lobe[i][c];
                const double l = pixels[i].radiance[c];
                double v = weight[i];
                if (round > 0) v *= delta / std::max(delta, std::abs(d * a + s * w - l));
                aa += v * a * a;
                aw += v * a * w;
                ww += v * w * w;
                as += v * a * l;
                ws += v * w * l;
            }
            const double only_d = aa > 0 ? std::max(0.0, as / aa) : 0.0;
            const double only_s = ww > 0 ? std::max(0.0, ws / ww) : 0.0;
            const double determinant = aa * ww - aw * aw;
            d = only_d;
            s = 0.0;
            if (with_lobe && determinant > 1e-12 * aa * ww) {
                d = (as * ww - ws * aw) / determinant;
                s = (ws * aa - as * aw) / determinant;
                if (s < 0.0) {
                    d = only_d;
                    s = 0.0;
                } else if (d < 0.0) {
                    d = 0.0;
                    s = only_s;
                }
            }
        }
        result.rho_d[c] = static_cast<float>(d);
        result.rho_s[c] = static_cast<float>(s);
    }
    double sum = 0.0, total = 1e-12;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (weight[i] == 0.0) continue;
        const Rgb model_value = result.rho_d * columns.diffuse[i] + result.rho_s * columns.lobe[i];
        const double e =
            static_cast<double>((model_value - pixels[i].radiance).abs().mean()) / bright;
        sum += weight[i] * std::min(e, kCap);
        total += weight[i];
    }
    result.cost = sum / total;
    return result;
}

}  // namespace

SpecularModel::SpecularModel(const EstimationScene& scene, const std::vector<ObjectPixel>& pixels,
                             const KnownLight& light, const SpecularOptions& options)
    : scene_(scene), pixels_(pixels), light_(light), options_(options) {
    std::vector<SurfacePoint> points;
    for (const ObjectPixel& p : pixels) points.push_back(p.surface);
    const GatheredLight gathered = gather_light(scene, points, kGatherRays, 0, {}, 0x5bec);
    irradiance_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        irradiance_[i] = gathered.bounced[i] + light.ambient * gathered.openness[i];
    for (const DiscLight& lamp : light.lights) {
        const TrialLight trial{lamp.position_m, lamp.normal, lamp.radius_m};
        const DirectColumn column =
            direct_column(scene, points, trial, options.disc_samples, light.opaque_mask, 0);
        const DirectColumn open = direct_column(scene, points, trial, options.disc_samples, 0, 0);
        std::vector<float> visible(points.size());
        for (std::size_t i = 0; i < points.size(); ++i) {
            irradiance_[i] += column.clear[i] * lamp.intensity_w_per_sr;
            visible[i] = open.clear[i] > 0 ? std::min(1.0f, column.clear[i] / open.clear[i]) : 0.0f;
        }
        visibility_.push_back(std::move(visible));
    }
}

SpecularColumns SpecularModel::columns(double sigma, WardForm form) const {
    SpecularColumns columns;
    columns.diffuse.resize(pixels_.size());
    columns.lobe.resize(pixels_.size());
    parallel_for(pixels_.size(), 32, [&](std::size_t i) {
        columns.diffuse[i] = irradiance_[i] / kPif;
        columns.lobe[i] =
            reflected_surroundings(scene_, pixels_[i], light_, sigma, form, options_.lobe_samples,
                                   static_cast<std::uint32_t>(stream_key(0x10beu, i)));
        for (std::size_t k = 0; k < light_.lights.size(); ++k)
            if (visibility_[k][i] > 0.0f)
                columns.lobe[i] +=
                    visibility_[k][i] *
                    direct_lobe(pixels_[i], light_.lights[k], sigma, form, options_.disc_samples);
    });
    return columns;
}

WardFit fit_ward(const SpecularModel& model, double bright, const SpecularOptions& options) {
    WardFit fit;
    fit.pixel_count = static_cast<int>(model.pixels().size());
    if (model.pixels().empty()) {
        fit.sigma.reason = "no pixel shows this object";
        return fit;
    }
    const double low = std::log(options.sigma_min), high = std::log(options.sigma_max);
    double best_log_sigma = low;
    for (const WardForm form : {WardForm::Ward, WardForm::Duer}) {
        const Minimum1d minimum = minimise_grid_golden(
            [&](double log_sigma) {
                return solve(model, model.columns(std::exp(log_sigma), form), bright, true, {})
                    .cost;
            },
            low, high, options.sigma_grid, 8);
        if (form == WardForm::Ward || minimum.value < fit.cost) {
            fit.cost = minimum.value;
            fit.ward.form = form;
            best_log_sigma = minimum.x;
            fit.sigma.outcome = minimum.is_at_bound ? Outcome::AtBound : Outcome::Converged;
        }
    }
    const double sigma = std::exp(best_log_sigma);
    const SpecularColumns columns = model.columns(sigma, fit.ward.form);
    const Linear best = solve(model, columns, bright, true, {});
    fit.ward.rho_d = best.rho_d;
    fit.ward.rho_s = best.rho_s;
    const Linear diffuse = solve(model, columns, bright, false, {});
    fit.cost_diffuse = diffuse.cost;
    fit.albedo = diffuse.rho_d.min(1.0f);
    fit.sigma.residual_rms = fit.cost;
    double lobe = 0.0, all = 1e-12;
    for (std::size_t i = 0; i < columns.lobe.size(); ++i) {
        const double s = luminance(Rgb(best.rho_s * columns.lobe[i]));
        lobe += s;
        all += s + luminance(Rgb(best.rho_d * columns.diffuse[i]));
    }
    fit.lobe_share = lobe / all;

    // Normals of a hull scatter: the lobe seen is the true one widened by them.
    const double noise = options.normal_noise_rad;
    const double corrected = std::sqrt(std::max(sigma * sigma - 2.0 * noise * noise, 1e-4));
    fit.sigma.value = corrected;
    fit.ward.sigma_x = fit.ward.sigma_y = corrected;
    if (sigma * sigma < 2.5 * noise * noise) {
        fit.sigma.outcome = Outcome::NotIdentifiable;
        fit.sigma.reason = "the hull's normals scatter more than the lobe is wide";
    } else if (fit.sigma.outcome == Outcome::AtBound) {
        fit.sigma.reason = "the best roughness lies at the end of the range";
    }

    // Spread of sigma over resampled views, among five neighbours of the best.
    constexpr std::array<double, 5> kFactors = {0.8, 0.9, 1.0, 1.12, 1.25};
    std::vector<SpecularColumns> near;
    for (const double factor : kFactors)
        near.push_back(model.columns(sigma * factor, fit.ward.form));
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
        Linear least;
        least.cost = 2.0;
        double at = sigma;
        for (std::size_t k = 0; k < near.size(); ++k) {
            const Linear trial = solve(model, near[k], bright, true, count);
            if (trial.cost < least.cost) {
                least = trial;
                at = sigma * kFactors[k];
            }
        }
        sigmas.push_back(at);
        for (int c = 0; c < 3; ++c) {
            rho[static_cast<std::size_t>(c)].push_back(least.rho_d[c]);
            rho[static_cast<std::size_t>(3 + c)].push_back(least.rho_s[c]);
        }
    }
    fit.sigma.stddev = std::max(0.03 * corrected, standard_deviation(sigmas));
    for (int c = 0; c < 3; ++c) {
        fit.stddev_rho_d[c] =
            static_cast<float>(standard_deviation(rho[static_cast<std::size_t>(c)]));
        fit.stddev_rho_s[c] =
            static_cast<float>(standard_deviation(rho[static_cast<std::size_t>(3 + c)]));
    }
    return fit;
}

std::vector<Rgb> predict_ward(const SpecularModel& model, const Ward& ward) {
    const SpecularColumns columns = model.columns(ward.sigma_x, ward.form);
    std::vector<Rgb> picture(columns.lobe.size());
    for (std::size_t i = 0; i < picture.size(); ++i)
        picture[i] = ward.rho_d * columns.diffuse[i] + ward.rho_s * columns.lobe[i];
    return picture;
}

}  // namespace vitrine
