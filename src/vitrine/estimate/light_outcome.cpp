#include "estimate/light_outcome.h"

#include "base/log.h"
#include "estimate/model_error.h"

#include <cmath>

namespace vitrine {

namespace {

constexpr double kMaxDirectionDeviationDeg = 15.0;  // more doubt is no answer

double irradiance(const PolarLight& light) {
    return light.weight / (light.distance_m * light.distance_m);
}

const LampError& model_error_of(const LightSet& set, std::size_t k, bool is_distant) {
    if (set.lights.size() == 1) return is_distant ? kSun : kSingleLamp;
    for (const PolarLight& other : set.lights)
        if (irradiance(other) > irradiance(set.lights[k])) return kWeakerLamp;
    return kStrongestLamp;
}

/// How much larger lamp `k` may be, all else held, before the scan objects by one deviation from
/// block to block; metres. Penumbrae narrower than a sample's footprint look alike, so the
/// curvature where a small lamp was found says nothing of larger ones.
double larger_by(const LightFit& fit, const LightSet& set, std::size_t k) {
    constexpr double kFactor = 1.5, kFirst_m = 0.004, kMaxRadiusPerDistance = 0.3;
    constexpr int kDiscSamples = 16;
    const double found = set.lights[k].radius_m;
    double last = found, last_evidence = 0.0;
    for (double radius = std::max(kFactor * found, kFirst_m);
         radius < kMaxRadiusPerDistance * set.lights[k].distance_m; radius *= kFactor) {
        LightSet trial = set;
        trial.lights[k].radius_m = radius;
        trial.score = fit.score(columns_of(fit, trial.lights, kDiscSamples, 1), 1, kLuminance);
        const double evidence = evidence_over(fit, set, trial);
        if (evidence >= 1.0) {
            const double share = (1.0 - last_evidence) / (evidence - last_evidence);
            return last + share * (radius - last) - found;
        }
        last = radius;
        last_evidence = std::max(0.0, evidence);
    }
    return last - found;
}

}  // namespace

FittedLight with_deviations(const LightFit& fit, const LightSet& set, std::size_t k,
                            const LightDeviation& deviation, bool is_distant) {
    const PolarLight& polar = set.lights[k];
    const TrialLight trial = to_trial(polar, fit.samples().reference_point);
    FittedLight fitted;
    fitted.light = {trial.position_m, trial.normal, trial.radius_m, Rgb::Ones()};
    fitted.is_distant = is_distant;
    const LampError& model = model_error_of(set, k, is_distant);
    log_debug(
        "light {}: resampled deviations of angle {:.5f} rad, distance {:.4f}, radius {:.3f}, "
        "intensity {:.4f}",
        k, deviation.direction_rad, deviation.log_distance, deviation.log_radius,
        deviation.log_intensity);
    const double log_distance = std::hypot(deviation.log_distance, model.log_distance);
    fitted.stddev_direction_deg =
        degrees(std::hypot(std::sqrt(2.0) * deviation.direction_rad, model.direction_rad));
    fitted.stddev_distance_m = polar.distance_m * log_distance;
    fitted.stddev_radius_m = std::max(
        trial.radius_m * std::hypot(deviation.log_radius, deviation.log_distance, kModelLogRadius),
        larger_by(fit, set, k));
    fitted.stddev_intensity_ratio =
        std::hypot(deviation.log_intensity, 2.0 * model.log_distance, model.log_irradiance);
    fitted.stddev_irradiance_ratio = std::hypot(deviation.log_irradiance, model.log_irradiance);
    fitted.outcome = Outcome::Converged;
    if (!deviation.is_identifiable || fitted.stddev_direction_deg > kMaxDirectionDeviationDeg) {
        fitted.outcome = Outcome::NotIdentifiable;
        fitted.reason = "no shadow or second surface tells where this light stands";
    } else if (is_at_bound(fit, polar)) {
        fitted.outcome = Outcome::AtBound;
        fitted.reason =
            "the best place lies where lights are no longer looked for: within the scene or as "
            "low as the table";
    }
    return fitted;
}

}  // namespace vitrine
