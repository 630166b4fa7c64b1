#include "world_errors.h"

#include "base/json_reader.h"
#include "estimate/object_pixels.h"
#include "optics/ward.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

namespace vitrine {

namespace {

std::string kind_of(const WorldOptions& options) {
    const char* object = "nothing";
    switch (options.object) {
        case WorldObject::None:
            break;
        case WorldObject::Glass:
            object = "glass";
            break;
        case WorldObject::Vessel:
            object = "vessel";
            break;
        case WorldObject::Metal:
            object = "metal";
            break;
        case WorldObject::Plastic:
            object = "plastic";
            break;
    }
    const char* shape = "";
    switch (options.shape) {
        case WorldShape::BallOrBottle:
            break;
        case WorldShape::Ball:
            shape = " ball";
            break;
        case WorldShape::Bottle:
            shape = " bottle";
            break;
        case WorldShape::Torus:
            shape = " torus";
            break;
        case WorldShape::Pebble:
            shape = " pebble";
            break;
    }
    const char* light = options.is_sunny          ? ", sun"
                        : options.light_count > 1 ? ", 2 lamps"
                                                  : ", lamp";
    return std::string(object) + (options.object == WorldObject::Vessel ? "" : shape) + light;
}

std::string true_class_of(WorldObject object) {
    switch (object) {
        case WorldObject::Glass:
            return "transparent";
        case WorldObject::Vessel:
            return "hollow";
        case WorldObject::Metal:
            return "specular";
        case WorldObject::Plastic:
            return "diffuse";
        case WorldObject::None:
            break;
    }
    return "none";
}

std::string found_class_of(const SceneEstimate& estimate) {
    if (estimate.objects.empty()) return "none";
    const ObjectEstimate& object = estimate.objects[0];
    if (object.object_class == ObjectClass::Transparent && object.is_hollow) return "hollow";
    return class_name(object.object_class);
}

/// Errors and deviations both in shares of the truth.
void add_light(const DiscLight& truth, const FittedLight& fitted, const Vec3& reference,
               bool is_sunny, int rank, std::vector<QuantityError>& out) {
    const std::string name = rank == 0 ? "" : "second_";
    const std::string outcome = outcome_name(fitted.outcome);
    const Vec3 from = fitted.is_distant ? reference : Vec3::Zero();
    const Vec3 found = fitted.light.position_m - from;
    out.push_back({name + "direction_deg", degrees(angle_between(found, truth.position_m - from)),
                   fitted.stddev_direction_deg, outcome});
    if (is_sunny) {
        out.push_back({name + "sun_called_distant", fitted.is_distant ? 0.0 : 1.0, -1.0, outcome});
        return;
    }
    const double distance = truth.position_m.norm();
    const double intensity = luminance(truth.intensity_w_per_sr);
    const std::string weak = fitted.is_distant ? "not_identifiable" : outcome;
    out.push_back({name + "distance_percent", 100.0 * (found.norm() / distance - 1.0),
                   100.0 * fitted.stddev_distance_m / distance, weak});
    const double intensity_ratio = luminance(fitted.light.intensity_w_per_sr) / intensity;
    out.push_back({name + "intensity_percent", 100.0 * (intensity_ratio - 1.0),
                   100.0 * fitted.stddev_intensity_ratio * intensity_ratio, weak});
    out.push_back({name + "disc_radius_percent",
                   100.0 * (fitted.light.radius_m / truth.radius_m - 1.0),
                   100.0 * fitted.stddev_radius_m / truth.radius_m, weak});
}

/// What a lobe reflects of surroundings of radiance 1 toward `wo` (local), per unit rho_s: half
/// vectors drawn after the lobe (Ward 1992, Eq. 7 and 8), on a fixed grid.
double reflected_of_even(const Vec3& wo, const Ward& ward) {
    constexpr int kRings = 8, kSpokes = 16;
    double sum = 0.0;
    for (int ring = 0; ring < kRings; ++ring)
        for (int spoke = 0; spoke < kSpokes; ++spoke) {
            const double radius = ward.sigma_x * std::sqrt(-std::log((ring + 0.5) / kRings));
            const double phi = 2.0 * kPi * spoke / kSpokes;
            const Vec3 h = Vec3(radius * std::cos(phi), radius * std::sin(phi), 1.0).normalized();
            const Vec3 wi = 2.0 * wo.dot(h) * h - wo;
            if (wi.z() <= 0.0 || wo.dot(h) <= 0.0) continue;
            const double density =
                std::exp(-radius * radius / (ward.sigma_x * ward.sigma_x)) /
                (4.0 * kPi * ward.sigma_x * ward.sigma_x * wo.dot(h) * std::pow(h.z(), 3.0));
            sum += wi.z() * ward_lobe(wo, wi, ward.sigma_x, ward.form == WardForm::Duer) / density;
        }
    return sum / (kRings * kSpokes);
}

/// The fitted lobe over the true one: what they reflect of even surroundings toward the pixels that
/// see the object. What rho_s means depends on the form of the lobe, this does not, and on its
/// width, whose error has a row of its own, hardly.
double lobe_ratio(const World& world, const Ward& fitted, const Ward& truth) {
    const EstimationScene scene(world.labelled);
    const FrameLookup lookup(scene, world.labelled.cameras, world.capture.frames,
                             world.capture.saturation_level);
    double sum = 0.0, true_sum = 1e-12;
    for (const ObjectPixel& pixel : object_pixels(scene, lookup, 0)) {
        const Vec3 wo = Frame(pixel.surface.normal).to_local(-pixel.direction).cast<double>();
        if (wo.z() <= 0.0) continue;
        sum += luminance(fitted.rho_s) * reflected_of_even(wo, fitted);
        true_sum += luminance(truth.rho_s) * reflected_of_even(wo, truth);
    }
    return sum / true_sum;
}

void add_object(const WorldOptions& options, const World& world, const ObjectEstimate& object,
                std::vector<QuantityError>& out) {
    if (const auto* glass = std::get_if<Dielectric>(&world.truth.parts[1].material)) {
        if (object.object_class != ObjectClass::Transparent) return;
        if (options.object == WorldObject::Vessel) {
            if (object.is_hollow)
                out.push_back({"wall_log2_ratio", std::log2(object.wall_m.value / world.wall_m),
                               object.wall_m.stddev / (object.wall_m.value * std::log(2.0)),
                               outcome_name(object.wall_m.outcome)});
            return;
        }
        if (object.is_hollow) return;
        out.push_back({"ior", object.ior.value - glass->ior, object.ior.stddev,
                       outcome_name(object.ior.outcome)});
        for (int c = 0; c < 3; ++c)
            out.push_back(
                {"absorption_per_m", object.sigma_a_per_m.value[c] - glass->sigma_a_per_m[c],
                 object.sigma_a_per_m.stddev[c], outcome_name(object.sigma_a_per_m.outcome)});
    }
    const auto* ward = std::get_if<Ward>(&world.truth.parts[1].material);
    if (ward && object.object_class == ObjectClass::Specular && !object.clusters.empty()) {
        const WardFit& fit = object.clusters[0].fit;
        const std::string outcome = outcome_name(fit.sigma.outcome);
        out.push_back({"sigma_percent", 100.0 * (fit.ward.sigma_x / ward->sigma_x - 1.0),
                       100.0 * fit.sigma.stddev / ward->sigma_x, outcome});
        for (int c = 0; c < 3; ++c)
            out.push_back(
                {"rho_d", fit.ward.rho_d[c] - ward->rho_d[c], fit.stddev_rho_d[c], outcome});
        const double lobe = lobe_ratio(world, fit.ward, *ward);
        out.push_back({"lobe_percent", 100.0 * (lobe - 1.0),
                       100.0 * lobe * luminance(fit.stddev_rho_s) / luminance(fit.ward.rho_s),
                       outcome});
    }
}

}  // namespace

WorldErrors compare(const WorldOptions& options, const World& world,
                    const SceneEstimate& estimate) {
    WorldErrors errors;
    errors.seed = options.seed;
    errors.kind = kind_of(options);
    errors.true_class = true_class_of(options.object);
    errors.found_class = found_class_of(estimate);
    errors.true_lights = static_cast<int>(world.lights.size());
    errors.found_lights = static_cast<int>(estimate.light.lights.size());
    const Vec3 reference = estimate.light.reference_point_m;
    errors.grid_error_deg = 180.0;
    for (const DiscLight& light : world.lights)
        errors.grid_error_deg = std::min(
            errors.grid_error_deg,
            degrees(angle_between(light.position_m - reference, estimate.light.grid_direction)));
    const auto elevation = [&](const Vec3& d) {
        return degrees(
            std::asin(std::clamp(d.normalized().dot(estimate.light.plane.normal), -1.0, 1.0)));
    };
    for (const DiscLight& light : world.lights) {
        const Vec3 is = light.position_m - reference;
        double angle = 180.0, elevation_error = 90.0;
        for (const FittedLight& fitted : estimate.light.lights) {
            const Vec3 found = fitted.light.position_m - reference;
            const double a = degrees(angle_between(is, found));
            if (a >= angle) continue;
            angle = a;
            elevation_error = std::abs(elevation(found) - elevation(is));
        }
        const auto share = 1.0 / static_cast<double>(world.lights.size());
        errors.light_direction_deg += share * angle;
        errors.light_elevation_deg += share * elevation_error;
    }
    // Strongest first; each true light takes the nearest found one that is left.
    std::vector<char> taken(estimate.light.lights.size(), 0);
    for (std::size_t k = 0; k < world.lights.size(); ++k) {
        int nearest = -1;
        double least = 1e9;
        for (std::size_t i = 0; i < taken.size(); ++i) {
            const double angle =
                angle_between(world.lights[k].position_m - reference,
                              estimate.light.lights[i].light.position_m - reference);
            if (taken[i] || angle >= least) continue;
            least = angle;
            nearest = static_cast<int>(i);
        }
        if (nearest < 0) continue;
        taken[static_cast<std::size_t>(nearest)] = 1;
        add_light(world.lights[k], estimate.light.lights[static_cast<std::size_t>(nearest)],
                  reference, options.is_sunny, static_cast<int>(k), errors.quantities);
    }
    if (!estimate.objects.empty() && world.truth.parts.size() > 1)
        add_object(options, world, estimate.objects[0], errors.quantities);
    return errors;
}

std::vector<WorldErrors> read_world_errors(const std::filesystem::path& file) {
    std::vector<WorldErrors> all;
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
        const Json j = Json::parse(line, nullptr, false);
        if (j.is_discarded()) continue;  // a line cut short by an interrupted run
        WorldErrors errors;
        errors.seed = j["seed"];
        errors.kind = j["kind"];
        errors.world_cpu_seconds = j["world_cpu_seconds"];
        errors.estimate_cpu_seconds = j["estimate_cpu_seconds"];
        errors.true_class = j["true_class"];
        errors.found_class = j["found_class"];
        errors.true_lights = j["true_lights"];
        errors.found_lights = j["found_lights"];
        errors.grid_error_deg = j["grid_error_deg"];
        errors.light_direction_deg = j["light_direction_deg"];
        errors.light_elevation_deg = j["light_elevation_deg"];
        for (const Json& q : j["quantities"])
            errors.quantities.push_back({q["name"], q["error"], q["stddev"], q["outcome"]});
        all.push_back(std::move(errors));
    }
    return all;
}

void append_world_errors(const std::filesystem::path& file, const WorldErrors& errors) {
    Json j = {{"seed", errors.seed},
              {"kind", errors.kind},
              {"world_cpu_seconds", errors.world_cpu_seconds},
              {"estimate_cpu_seconds", errors.estimate_cpu_seconds},
              {"true_class", errors.true_class},
              {"found_class", errors.found_class},
              {"true_lights", errors.true_lights},
              {"found_lights", errors.found_lights},
              {"grid_error_deg", errors.grid_error_deg},
              {"light_direction_deg", errors.light_direction_deg},
              {"light_elevation_deg", errors.light_elevation_deg},
              {"quantities", Json::array()}};
    for (const QuantityError& q : errors.quantities)
        j["quantities"].push_back(
            {{"name", q.name}, {"error", q.error}, {"stddev", q.stddev}, {"outcome", q.outcome}});
    std::ofstream(file, std::ios::app) << j.dump() << '\n';
}

std::string one_line(const WorldErrors& errors) {
    char text[200];
    std::snprintf(text, sizeof text, "%4d %-24s %s -> %s, %d -> %d lights, %.1f + %.1f CPU s,",
                  static_cast<int>(errors.seed), errors.kind.c_str(), errors.true_class.c_str(),
                  errors.found_class.c_str(), errors.true_lights, errors.found_lights,
                  errors.world_cpu_seconds, errors.estimate_cpu_seconds);
    std::string line = text;
    for (const QuantityError& q : errors.quantities) {
        std::snprintf(text, sizeof text, " %s %.3g (%.2g%s)", q.name.c_str(), q.error, q.stddev,
                      q.outcome == "converged" ? "" : " !");
        line += text;
    }
    return line;
}

}  // namespace vitrine
