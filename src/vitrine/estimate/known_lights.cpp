#include "estimate/known_lights.h"

#include "base/error.h"

namespace vitrine {

namespace {

constexpr double kPointRadius = 1e-3;  // metres (or of the distance): a point's disc

FittedLight as_given(const Light& light, const Vec3& reference, double scene_radius_m) {
    FittedLight fitted;
    fitted.outcome = Outcome::Converged;
    if (const auto* disc = std::get_if<DiscLight>(&light)) {
        fitted.light = *disc;
    } else if (const auto* point = std::get_if<PointLight>(&light)) {
        fitted.light = {point->position_m, (reference - point->position_m).normalized(),
                        kPointRadius, point->intensity_w_per_sr};
    } else if (const auto* sun = std::get_if<DirectionalLight>(&light)) {
        const double d = kDistantPerRadius * scene_radius_m;
        fitted.light = {reference - d * sun->direction, sun->direction, kPointRadius * d,
                        sun->irradiance_w_per_m2 * static_cast<float>(d * d)};
        fitted.is_distant = true;
    } else {
        throw InputError({"lights of the overrides file", "point, disc or directional",
                          kind_name(light), "leave it out to have it estimated"});
    }
    return fitted;
}

}  // namespace

void use_known_lights(LightFit& fit, std::span<const Light> lights, LightEstimate& estimate) {
    constexpr int kDiscSamples = 32;
    std::vector<DirectColumn> columns;
    for (const Light& light : lights) {
        const FittedLight fitted =
            as_given(light, fit.samples().reference_point, fit.samples().scene_radius_m);
        columns.push_back(
            fit.column({fitted.light.position_m, fitted.light.normal, fitted.light.radius_m},
                       kDiscSamples, 1));
        estimate.lights.push_back(fitted);
    }
    fit.know_intensity();
    estimate.albedo_anchor = "known_lights";
    for (const int channel : {0, 1, 2, kLuminance}) {
        LightColumns sum;
        for (std::size_t k = 0; k < columns.size(); ++k) {
            const Rgb& intensity = estimate.lights[k].light.intensity_w_per_sr;
            sum.add(columns[k], channel == kLuminance ? luminance(intensity) : intensity[channel]);
        }
        const LightScore score = fit.score(sum, 1, channel);
        if (channel == kLuminance) {
            estimate.error_initial = estimate.error_refined = score.cost;
            estimate.residual_rms = score.residual_rms;
        } else {
            estimate.ambient_radiance[channel] = static_cast<float>(score.ambient_ratio);
        }
    }
    estimate.outcome = Outcome::Converged;
}

}  // namespace vitrine
