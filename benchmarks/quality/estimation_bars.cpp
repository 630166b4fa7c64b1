#include "estimation_bars.h"

#include "estimate/object_pixels.h"
#include "math/statistics.h"
#include "optics/ward.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace vitrine {

namespace {

Bar below(std::string capture, std::string quantity, double value, double limit,
          std::string note = {}) {
    return {std::move(capture), std::move(quantity), value, limit, std::move(note)};
}
Bar must(std::string capture, std::string quantity, bool is_so, std::string note) {
    return {std::move(capture), std::move(quantity), is_so ? 1.0 : 0.0, 1.0, std::move(note), true};
}

std::string pair_of(const char* format, double found, double truth) {
    char text[80];
    std::snprintf(text, sizeof text, format, found, truth);
    return text;
}

/// Beckmann lobe with Smith's masking as the captures were made with (their README), per unit
/// rho_s: D G / (4 cos_i cos_o).
double beckmann_lobe(const Vec3& wo, const Vec3& wi, double alpha) {
    const Vec3 h = (wo + wi).normalized();
    const double cos2 = h.z() * h.z(), tan2 = (1.0 - cos2) / cos2;
    const auto lambda = [&](const Vec3& w) {
        const double tan_w = std::sqrt(std::max(0.0, 1.0 - w.z() * w.z())) / w.z();
        if (tan_w <= 0.0) return 0.0;
        const double a = 1.0 / (alpha * tan_w);
        return 0.5 * (std::erf(a) - 1.0) + std::exp(-a * a) / (2.0 * a * std::sqrt(kPi));
    };
    const double d = std::exp(-tan2 / (alpha * alpha)) / (kPi * alpha * alpha * cos2 * cos2);
    const double g = 1.0 / (1.0 + lambda(wo) + lambda(wi));
    return d * g / (4.0 * wo.z() * wi.z());
}

/// ||f_fitted - f_true|| / ||f_true|| over the angles in which the pictures see the object lit by
/// the true lamps, all channels.
double brdf_error(const TrueScene& truth, const TrueObject& object, const Scene& scene,
                  const Capture& pictures, int index, const Ward& ward) {
    constexpr double kMinCos = 0.2;  // as the estimator: flatter pixels are not used
    const EstimationScene world(scene);
    const FrameLookup lookup(world, scene.cameras, pictures.frames, pictures.saturation_level);
    double error = 0.0, norm = 0.0;
    for (const ObjectPixel& pixel : object_pixels(world, lookup, index)) {
        const Frame frame(pixel.surface.normal);
        const Vec3 wo = frame.to_local(-pixel.direction).cast<double>();
        for (const DiscLight& lamp : truth.lights) {
            const Vec3f to_lamp =
                (lamp.position_m.cast<float>() - pixel.surface.position).normalized();
            const Vec3 wi = frame.to_local(to_lamp).cast<double>();
            if (wo.z() < kMinCos || wi.z() < kMinCos) continue;
            const double b = beckmann_lobe(wo, wi, object.sigma);
            const double w = ward_lobe(wo, wi, ward.sigma_x, ward.form == WardForm::Duer);
            const Rgb is = object.rho_d / kPif + object.rho_s * static_cast<float>(b);
            const Rgb fitted = ward.rho_d / kPif + ward.rho_s * static_cast<float>(w);
            error += static_cast<double>((fitted - is).square().sum());
            norm += static_cast<double>(is.square().sum());
        }
    }
    return norm > 0.0 ? std::sqrt(error / norm) : 1.0;
}

void add_glass_bars(const std::string& capture, const TrueObject& truth,
                    const ObjectEstimate& object, GeometrySource source, std::vector<Bar>& bars) {
    if (truth.is_hollow) {
        bars.push_back(must(capture, truth.name + ": hollow", object.is_hollow,
                            object.is_hollow ? "hollow" : "called solid"));
        const double factor = std::max(object.wall_m.value / truth.wall_m,
                                       truth.wall_m / std::max(object.wall_m.value, 1e-6));
        const bool is_open = object.wall_m.outcome == Outcome::NotIdentifiable ||
                             object.ior.outcome == Outcome::NotIdentifiable;
        bars.push_back(must(capture,
                            truth.name + ": wall within a factor 2, or index not_identifiable",
                            is_open || factor <= 2.0,
                            pair_of("wall %.4f m, true %.4f", object.wall_m.value, truth.wall_m) +
                                ", wall " + outcome_name(object.wall_m.outcome) + ", index " +
                                outcome_name(object.ior.outcome)));
        return;
    }
    const double limit = source == GeometrySource::True ? 0.01 : 0.03;
    bars.push_back(below(capture, truth.name + ": index", std::abs(object.ior.value - truth.ior),
                         limit, pair_of("%.4f, true %.3f", object.ior.value, truth.ior)));
    for (int c = 0; c < 3; ++c) {
        const double is = truth.sigma_a_per_m[c], found = object.sigma_a_per_m.value[c];
        const double bound = is > 0.0 ? std::max(0.15 * is, 0.5) : 0.3;
        bars.push_back(below(capture, truth.name + ": absorption, 1/m, " + "rgb"[c],
                             std::abs(found - is), bound, pair_of("%.2f, true %.1f", found, is)));
    }
}

}  // namespace

const FittedLight* nearest_found(const TrueScene& truth, const DiscLight& light,
                                 const LightEstimate& estimate) {
    const FittedLight* nearest = nullptr;
    double least = 1e9;
    for (const FittedLight& fitted : estimate.lights) {
        const double angle = angle_between(light.position_m - truth.reference_point_m,
                                           fitted.light.position_m - truth.reference_point_m);
        if (angle < least) least = angle, nearest = &fitted;
    }
    return nearest;
}

double light_error_deg(const TrueScene& truth, const DiscLight& light,
                       const LightEstimate& estimate) {
    const FittedLight* fitted = nearest_found(truth, light, estimate);
    if (!fitted) return 180.0;
    return degrees(angle_between(light.position_m - truth.reference_point_m,
                                 fitted->light.position_m - truth.reference_point_m));
}

double grid_error_deg(const TrueScene& truth, const LightEstimate& estimate) {
    double least = kPi;
    for (const DiscLight& light : truth.lights)
        least = std::min(least, angle_between(light.position_m - truth.reference_point_m,
                                              estimate.grid_direction));
    return degrees(least);
}

void add_light_bars(const std::string& capture, const TrueScene& truth,
                    const LightEstimate& estimate, std::vector<Bar>& bars) {
    const bool is_single = truth.lights.size() == 1;
    bars.push_back(must(capture, "number of lights", estimate.lights.size() == truth.lights.size(),
                        pair_of("%.0f, true %.0f", static_cast<double>(estimate.lights.size()),
                                static_cast<double>(truth.lights.size()))));
    std::vector<double> ratio;
    for (const DiscLight& light : truth.lights) {
        const FittedLight* fitted = nearest_found(truth, light, estimate);
        if (!fitted) continue;
        const Vec3 found = fitted->light.position_m - truth.reference_point_m;
        const Vec3 is = light.position_m - truth.reference_point_m;
        bars.push_back(below(capture, "light direction, degrees",
                             light_error_deg(truth, light, estimate), is_single ? 2.0 : 5.0));
        const double gain =
            luminance(fitted->light.intensity_w_per_sr) / luminance(light.intensity_w_per_sr);
        ratio.push_back(gain);
        if (!is_single) continue;
        bars.push_back(below(capture, "light distance, %",
                             100.0 * std::abs(found.norm() / is.norm() - 1.0), 8.0,
                             pair_of("%.3f m, true %.3f", found.norm(), is.norm())));
        bars.push_back(below(capture, "on-axis intensity, %", 100.0 * std::abs(gain - 1.0), 10.0,
                             pair_of("%.3f, true %.3f", luminance(fitted->light.intensity_w_per_sr),
                                     luminance(light.intensity_w_per_sr))));
        bars.push_back(below(capture, "disc radius, %",
                             100.0 * std::abs(fitted->light.radius_m / light.radius_m - 1.0), 40.0,
                             pair_of("%.3f m, true %.3f", fitted->light.radius_m, light.radius_m)));
    }
    if (ratio.size() == 2)
        bars.push_back(below(capture, "ratio of the two intensities, %",
                             100.0 * std::abs(ratio[0] / ratio[1] - 1.0), 20.0));
}

void add_object_bars(const std::string& capture, const TrueScene& truth, const Scene& scene,
                     const Capture& pictures, const SceneEstimate& estimate, GeometrySource source,
                     std::vector<Bar>& bars) {
    const EstimationScene world(scene);
    std::size_t found = 0;
    for (int k = 0; k < world.object_count(); ++k) {
        const ObjectEstimate& object = estimate.objects[static_cast<std::size_t>(k)];
        const TrueObject* is = object_at(truth, world.mesh(world.part_of_object(k)));
        const std::string wanted = is ? is->object_class : "diffuse";
        const std::string name = is ? is->name : "false candidate";
        const std::string called = class_name(object.object_class);
        bars.push_back(must(capture, name + ": class", called == wanted, called));
        if (!is) continue;
        ++found;
        if (called != wanted) continue;
        if (wanted == "transparent") {
            add_glass_bars(capture, *is, object, source, bars);
            continue;
        }
        const WardFit& fit = object.clusters[0].fit;
        const Ward& ward = fit.ward;
        const std::string sigmas = pair_of("%.4f, true %.3f", ward.sigma_x, is->sigma);
        if (source == GeometrySource::Reconstructed) {
            const double factor = std::max(ward.sigma_x / is->sigma, is->sigma / ward.sigma_x);
            const bool is_unknown = fit.sigma.outcome == Outcome::NotIdentifiable;
            bars.push_back(below(capture, name + ": sigma, factor, or not_identifiable",
                                 is_unknown ? 1.0 : factor, 1.5,
                                 sigmas + ", " + outcome_name(fit.sigma.outcome)));
            continue;
        }
        bars.push_back(below(capture, name + ": sigma, %",
                             100.0 * std::abs(ward.sigma_x / is->sigma - 1.0), 15.0, sigmas));
        bars.push_back(below(
            capture, name + ": rho_d, %, worst channel",
            100.0 * static_cast<double>((ward.rho_d / is->rho_d - 1.0f).abs().maxCoeff()), 15.0));
        bars.push_back(below(capture, name + ": BRDF over the observed angles, relative rms %",
                             100.0 * brdf_error(truth, *is, scene, pictures, k, ward), 15.0,
                             ward.form == WardForm::Duer ? "Duer's form" : "Ward's form"));
    }
    bars.push_back(must(capture, "all objects found", found == truth.objects.size(),
                        pair_of("%.0f of %.0f", static_cast<double>(found),
                                static_cast<double>(truth.objects.size()))));
    const bool must_converge =
        truth.lights.size() == 1 && !truth.objects.empty() &&
        std::none_of(truth.objects.begin(), truth.objects.end(),
                     [](const TrueObject& object) { return object.is_hollow; });
    if (must_converge)
        bars.push_back(must(capture, "every quantity converged", estimate.is_complete(),
                            estimate.is_complete() ? "converged" : "not all"));
}

void add_mean_bars(const std::vector<double>& light_errors_deg,
                   const std::vector<double>& grid_errors_deg, std::vector<Bar>& bars) {
    if (light_errors_deg.empty()) return;
    bars.push_back(below("all", "mean light direction, degrees", mean(light_errors_deg), 1.2));
    bars.push_back(
        below("all", "light error over the best of the 36 grid lights'",
              mean(light_errors_deg) / mean(grid_errors_deg), 0.25,
              pair_of("%.2f against %.2f degrees", mean(light_errors_deg), mean(grid_errors_deg))));
}

const TrueObject* object_at(const TrueScene& truth, const Mesh& hull) {
    constexpr double kNear = 0.06;  // metres between the centres
    const Vec3 centre = bounds(hull).centre();
    const TrueObject* nearest = nullptr;
    for (const TrueObject& object : truth.objects)
        if ((object.centroid - centre).norm() < kNear) nearest = &object;
    return nearest;
}

void print_bars(const std::vector<Bar>& bars) {
    std::printf("\n| capture | quantity | value | bar | |\n|---|---|---|---|---|\n");
    int missed = 0;
    for (const Bar& bar : bars) {
        missed += !bar.is_met();
        std::printf("| %s | %s | %.3g%s%s | %s %.3g | %s |\n", bar.capture.c_str(),
                    bar.quantity.c_str(), bar.value, bar.note.empty() ? "" : ": ", bar.note.c_str(),
                    bar.is_at_least ? ">=" : "<=", bar.limit, bar.is_met() ? "pass" : "MISS");
    }
    std::printf("%zu bars, %d missed\n", bars.size(), missed);
}

}  // namespace vitrine
