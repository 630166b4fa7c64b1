#include "estimate/specular.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/sampling.h"
#include "optics/fresnel.h"
#include "optics/ward.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr int kGatherRays = 48;

/// Frame at the k-th of many places within the pixel (Roberts' R2 sequence): a lobe about as narrow
/// as the normal turns within a pixel is seen as the mean over it.
Frame frame_within(const ObjectPixel& pixel, int k) {
    const auto place = [k](float step) {
        const float x = 0.5f + step * static_cast<float>(k);
        return x - std::floor(x) - 0.5f;
    };
    return Frame(
        (pixel.surface.normal + place(0.7548777f) * pixel.turn_u + place(0.5698403f) * pixel.turn_v)
            .normalized());
}

/// Radiance per unit rho_s of the reflected surroundings, lamps left out. Half vectors follow the
/// lobe (Ward 1992, Eq. 7 and 8); what remains of f cos / pdf is cos^3 h (h.o) times the cosines.
Rgb reflected_surroundings(const EstimationScene& scene, const ObjectPixel& pixel,
                           const KnownLight& light, const WardLobe& lobe, int samples,
                           std::uint32_t key) {
    const Vec3f origin = pixel.surface.position + 2e-4f * pixel.surface.normal;
    Rgb sum = Rgb::Zero();
    for (int k = 0; k < samples; ++k) {
        const Frame frame = frame_within(pixel, k);
        const Vec3f wo = frame.to_local(-pixel.direction);
        const auto index = static_cast<std::uint32_t>(k);
        const float u = scrambled_sobol(index, 0, key), v = scrambled_sobol(index, 1, key);
        const float radius = std::sqrt(-std::log(1.0f - u)), phi = 2.0f * kPif * v;
        const Vec3f h = Vec3f(static_cast<float>(lobe.sigma_x) * radius * std::cos(phi),
                              static_cast<float>(lobe.sigma_y) * radius * std::sin(phi), 1.0f)
                            .normalized();
        const float cos_h = h.z();
        const float h_dot_o = h.dot(wo);
        if (h_dot_o <= 0.0f) continue;
        const Vec3f wi = reflect(wo, h);
        if (wi.z() <= 0.0f) continue;
        const float cos_i = std::max(wi.z(), static_cast<float>(kWardMinCos));
        const float cos_o = std::max(wo.z(), static_cast<float>(kWardMinCos));
        const float weight =
            h_dot_o * cos_h * cos_h * cos_h *
            (lobe.form == WardForm::Duer ? 1.0f / cos_o : std::sqrt(cos_i / cos_o));
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

/// Calls visit(wo, wi, weight) for each point of a lamp's disc that shines on the pixel: directions
/// local, weight = cos_i cos_l / (d^2 count).
template <typename Visit>
void for_each_lamp_point(const ObjectPixel& pixel, const DiscLight& lamp, int samples,
                         const Visit& visit) {
    const Frame disc(lamp.normal.cast<float>());
    for (int k = 0; k < samples; ++k) {
        const Frame frame = frame_within(pixel, k);
        const Vec3 wo = frame.to_local(-pixel.direction).cast<double>();
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
        visit(wo, wi, wi.z() * cos_l / (d2 * samples));
    }
}

/// Direct lobe of one lamp per unit rho_s, without its shadow.
Rgb direct_lobe(const ObjectPixel& pixel, const DiscLight& lamp, const WardLobe& lobe,
                int samples) {
    double sum = 0.0;
    for_each_lamp_point(pixel, lamp, samples, [&](const Vec3& wo, const Vec3& wi, double weight) {
        sum += weight * ward_lobe(wo, wi, lobe.sigma_x, lobe.sigma_y, lobe.form == WardForm::Duer);
    });
    return lamp.intensity_w_per_sr * static_cast<float>(sum);
}

}  // namespace

SpecularModel::SpecularModel(const EstimationScene& scene, const std::vector<ObjectPixel>& pixels,
                             const KnownLight& light, const SpecularOptions& options)
    : scene_(scene), pixels_(pixels), light_(light), options_(options) {
    std::vector<SurfacePoint> points;
    for (const ObjectPixel& p : pixels) points.push_back(p.surface);
    const GatheredLight gathered = gather_light(scene, points, kGatherRays, 0, {}, 0x5bec);
    soft_irradiance_.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        soft_irradiance_[i] = gathered.bounced[i] + light.ambient * gathered.openness[i];
    set_lamps(light.lights);
}

SpecularModel SpecularModel::with_lamps(const std::vector<DiscLight>& lamps) const {
    SpecularModel other = *this;
    other.set_lamps(lamps);
    return other;
}

void SpecularModel::set_lamps(const std::vector<DiscLight>& lamps) {
    light_.lights = lamps;
    irradiance_ = soft_irradiance_;
    visibility_.clear();
    std::vector<SurfacePoint> points;
    for (const ObjectPixel& p : pixels_) points.push_back(p.surface);
    for (const DiscLight& lamp : lamps) {
        const TrialLight trial{lamp.position_m, lamp.normal, lamp.radius_m};
        const DirectColumn column =
            direct_column(scene_, points, trial, options_.disc_samples, light_.opaque_mask, 0);
        const DirectColumn open = direct_column(scene_, points, trial, options_.disc_samples, 0, 0);
        std::vector<float> visible(points.size());
        for (std::size_t i = 0; i < points.size(); ++i) {
            irradiance_[i] += column.clear[i] * lamp.intensity_w_per_sr;
            visible[i] = open.clear[i] > 0 ? std::min(1.0f, column.clear[i] / open.clear[i]) : 0.0f;
        }
        visibility_.push_back(std::move(visible));
    }
}

double SpecularModel::lit_share() const {
    std::size_t lit = 0;
    for (std::size_t i = 0; i < pixels_.size(); ++i)
        lit += std::any_of(visibility_.begin(), visibility_.end(),
                           [&](const std::vector<float>& visible) { return visible[i] > 0.5f; });
    return pixels_.empty() ? 0.0 : static_cast<double>(lit) / static_cast<double>(pixels_.size());
}

std::vector<Rgb> SpecularModel::surroundings(const WardLobe& lobe) const {
    std::vector<Rgb> result(pixels_.size());
    parallel_for(pixels_.size(), 32, [&](std::size_t i) {
        result[i] = reflected_surroundings(scene_, pixels_[i], light_, lobe, options_.lobe_samples,
                                           static_cast<std::uint32_t>(stream_key(0x10beu, i)));
    });
    return result;
}

SpecularColumns SpecularModel::with_direct(const WardLobe& lobe,
                                           std::vector<Rgb> surroundings) const {
    SpecularColumns columns;
    columns.diffuse.resize(pixels_.size());
    columns.lobe = std::move(surroundings);
    parallel_for(pixels_.size(), 32, [&](std::size_t i) {
        columns.diffuse[i] = irradiance_[i] / kPif;
        for (std::size_t k = 0; k < light_.lights.size(); ++k)
            if (visibility_[k][i] > 0.0f)
                columns.lobe[i] += visibility_[k][i] * direct_lobe(pixels_[i], light_.lights[k],
                                                                   lobe, options_.disc_samples);
    });
    return columns;
}

SpecularColumns SpecularModel::columns(const WardLobe& lobe) const {
    return with_direct(lobe, surroundings(lobe));
}

WardProblem SpecularModel::problem(const WardLobe& lobe, const std::vector<Rgbd>& weight) const {
    const std::vector<Rgb> held = surroundings(lobe);
    WardProblem problem;
    for (const DiscLight& lamp : light_.lights)
        problem.lamp_colour.push_back(lamp.intensity_w_per_sr.cast<double>());
    problem.first_term.push_back(0);
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
        problem.observed.push_back(pixels_[i].radiance.cast<double>());
        problem.diffuse.push_back((irradiance_[i] / kPif).cast<double>());
        problem.held.push_back(held[i].cast<double>());
        problem.weight.push_back(weight[i]);
        for (std::size_t k = 0; k < light_.lights.size(); ++k) {
            if (visibility_[k][i] <= 0.0f) continue;
            for_each_lamp_point(
                pixels_[i], light_.lights[k], options_.disc_samples,
                [&](const Vec3& wo, const Vec3& wi, double term) {
                    const Vec3 h = wo + wi;
                    problem.tan2.push_back((h.x() * h.x() + h.y() * h.y()) / (h.z() * h.z()));
                    problem.lamp.push_back(static_cast<int>(k));
                    // The lobe at sigma = 1 less its exponential: what does not depend on sigma.
                    problem.strength.push_back(visibility_[k][i] * term *
                                               std::exp(problem.tan2.back()) *
                                               ward_lobe(wo, wi, 1.0, lobe.form == WardForm::Duer));
                });
        }
        problem.first_term.push_back(problem.tan2.size());
    }
    return problem;
}

std::vector<Rgb> predict_ward(const SpecularModel& model, const Ward& ward) {
    const SpecularColumns columns = model.columns({ward.sigma_x, ward.sigma_y, ward.form});
    std::vector<Rgb> picture(columns.lobe.size());
    for (std::size_t i = 0; i < picture.size(); ++i)
        picture[i] = ward.rho_d * columns.diffuse[i] + ward.rho_s * columns.lobe[i];
    return picture;
}

}  // namespace vitrine
