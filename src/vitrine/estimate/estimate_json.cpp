#include "estimate/estimate_json.h"

#include "base/json_reader.h"
#include "scene/scene_json.h"

namespace vitrine {

namespace {

const std::vector<std::string> kClassWords = {"transparent", "specular", "diffuse", "unsure"};
const std::vector<std::string> kOutcomeWords = {"converged", "at_bound", "ambiguous",
                                                "not_identifiable"};

Json number_json(double value) { return value; }
Json number_json(const Rgb& value) { return to_json(value); }

template <typename T>
Json estimate_json(const Estimate<T>& e) {
    Json j;
    j["value"] = number_json(e.value);
    j["stddev"] = number_json(e.stddev);
    j["outcome"] = outcome_name(e.outcome);
    if (!e.reason.empty()) j["reason"] = e.reason;
    j["residual"] = e.residual_rms;
    return j;
}

template <typename T>
Estimate<T> read_quantity(const JsonObject& j) {
    Estimate<T> e;
    if constexpr (std::is_same_v<T, double>) {
        e.value = j.number("value");
        e.stddev = j.number_or("stddev", 0.0);
    } else {
        e.value = read_rgb(j, "value");
        if (j.has("stddev")) e.stddev = read_rgb(j, "stddev");
    }
    e.outcome = outcome_from_name(j.choice("outcome", kOutcomeWords));
    e.reason = j.text_or("reason", "");
    e.residual_rms = j.number_or("residual", 0.0);
    j.ignore_rest();
    return e;
}

Json cluster_json(const WardCluster& cluster) {
    const WardFit& fit = cluster.fit;
    Json j;
    j["area_fraction"] = cluster.area_fraction;
    j["rho_d"] = to_json(fit.ward.rho_d);
    j["rho_s"] = to_json(fit.ward.rho_s);
    j["sigma"] = fit.sigma.value;
    if (fit.ward.sigma_x != fit.ward.sigma_y) {
        j["sigma_x"] = fit.ward.sigma_x;
        j["sigma_y"] = fit.ward.sigma_y;
    }
    j["form"] = fit.ward.form == WardForm::Duer ? "duer" : "ward";
    j["stddev_rho_d"] = to_json(fit.stddev_rho_d);
    j["stddev_rho_s"] = to_json(fit.stddev_rho_s);
    j["stddev_sigma"] = fit.sigma.stddev;
    j["outcome"] = outcome_name(fit.sigma.outcome);
    if (!fit.sigma.reason.empty()) j["reason"] = fit.sigma.reason;
    j["residual"] = fit.sigma.residual_rms;
    if (fit.certificate)
        j["certificate"] = {{"sigma", fit.certificate->sigma},
                            {"lower_bound", fit.certificate->lower_bound},
                            {"upper_bound", fit.certificate->upper_bound},
                            {"relative_gap", fit.certificate->relative_gap()},
                            {"nodes", fit.certificate->nodes},
                            {"is_complete", fit.certificate->is_complete}};
    return j;
}

WardCluster read_cluster(const JsonObject& j) {
    WardCluster cluster;
    cluster.area_fraction = j.number_or("area_fraction", 1.0);
    WardFit& fit = cluster.fit;
    fit.ward.rho_d = read_rgb(j, "rho_d");
    fit.ward.rho_s = read_rgb(j, "rho_s");
    fit.ward.sigma_x = fit.ward.sigma_y = fit.sigma.value = j.number("sigma");
    fit.ward.sigma_x = j.number_or("sigma_x", fit.sigma.value);
    fit.ward.sigma_y = j.number_or("sigma_y", fit.sigma.value);
    fit.ward.form = j.choice("form", {"ward", "duer"}) == "duer" ? WardForm::Duer : WardForm::Ward;
    if (j.has("stddev_rho_d")) fit.stddev_rho_d = read_rgb(j, "stddev_rho_d");
    if (j.has("stddev_rho_s")) fit.stddev_rho_s = read_rgb(j, "stddev_rho_s");
    fit.sigma.stddev = j.number_or("stddev_sigma", 0.0);
    fit.sigma.outcome = outcome_from_name(j.choice("outcome", kOutcomeWords));
    fit.sigma.reason = j.text_or("reason", "");
    fit.sigma.residual_rms = fit.cost = j.number_or("residual", 0.0);
    j.ignore_rest();
    return cluster;
}

Json object_json(const ObjectEstimate& object) {
    Json j;
    j["id"] = object.id;
    j["class"] = class_name(object.object_class);
    j["class_margin"] = object.class_margin;
    j["hollow"] = object.object_class == ObjectClass::Transparent && object.is_hollow;
    j["mesh"] = object.mesh_file;
    if (!object.reason.empty()) j["reason"] = object.reason;
    j["albedo"] = to_json(object.albedo);
    j["model_cost"] = {{"solid", object.cost_solid},
                       {"shell", object.cost_shell},
                       {"ward", object.cost_ward},
                       {"diffuse", object.cost_diffuse}};
    const bool is_unsure = object.object_class == ObjectClass::Unsure;
    if (object.object_class == ObjectClass::Transparent || is_unsure) {
        j["ior"] = estimate_json(object.ior);
        j["sigma_a_per_m"] = estimate_json(object.sigma_a_per_m);
        if (object.is_hollow) j["wall_m"] = estimate_json(object.wall_m);
    }
    if (object.object_class == ObjectClass::Specular || is_unsure) {
        j["clusters"] = Json::array();
        for (const WardCluster& cluster : object.clusters)
            j["clusters"].push_back(cluster_json(cluster));
    }
    return j;
}

ObjectEstimate read_object(const JsonObject& j) {
    ObjectEstimate object;
    object.id = j.text("id");
    object.object_class = class_from_name(j.choice("class", kClassWords));
    object.class_margin = j.number_or("class_margin", 0.0);
    object.is_hollow = j.boolean_or("hollow", false);
    object.mesh_file = j.text_or("mesh", "");
    object.reason = j.text_or("reason", "");
    if (j.has("albedo")) object.albedo = read_rgb(j, "albedo");
    if (j.has("model_cost")) {
        const JsonObject cost = j.object("model_cost");
        object.cost_solid = cost.number_or("solid", 1.0);
        object.cost_shell = cost.number_or("shell", 1.0);
        object.cost_ward = cost.number_or("ward", 1.0);
        object.cost_diffuse = cost.number_or("diffuse", 1.0);
    }
    if (j.has("ior")) object.ior = read_quantity<double>(j.object("ior"));
    if (j.has("sigma_a_per_m"))
        object.sigma_a_per_m = read_quantity<Rgb>(j.object("sigma_a_per_m"));
    if (j.has("wall_m")) object.wall_m = read_quantity<double>(j.object("wall_m"));
    if (j.has("clusters"))
        for (const JsonObject& cluster : j.objects("clusters"))
            object.clusters.push_back(read_cluster(cluster));
    j.ignore_rest();
    return object;
}

/// A light whose distance the pictures do not tell is written as a directional one.
Json light_json(const FittedLight& fitted, const LightEstimate& estimate) {
    Json j = fitted.is_distant ? to_json(as_directional(fitted, estimate.reference_point_m))
                               : to_json(Light(fitted.light));
    j["stddev_direction_deg"] = fitted.stddev_direction_deg;
    j["stddev_distance_m"] = fitted.stddev_distance_m;
    j["stddev_radius_m"] = fitted.stddev_radius_m;
    j["stddev_intensity_ratio"] = fitted.stddev_intensity_ratio;
    j["stddev_irradiance_ratio"] = fitted.stddev_irradiance_ratio;
    j["is_distant"] = fitted.is_distant;
    if (fitted.is_distant)
        j["angular_radius_rad"] =
            fitted.light.radius_m / (fitted.light.position_m - estimate.reference_point_m).norm();
    j["outcome"] = outcome_name(fitted.outcome);
    if (!fitted.reason.empty()) j["reason"] = fitted.reason;
    return j;
}

FittedLight read_fitted_light(const JsonObject& j, const LightEstimate& estimate) {
    FittedLight fitted;
    if (j.choice("kind", {"disc", "directional"}) == "disc") {
        fitted.light.position_m = read_vec3(j, "position_m");
        fitted.light.normal = read_vec3(j, "normal").normalized();
        fitted.light.radius_m = j.number("radius_m");
        fitted.light.intensity_w_per_sr = read_rgb(j, "intensity_w_per_sr");
    } else {
        const double d = kDistantPerRadius * estimate.scene_radius_m;
        const Vec3 direction = read_vec3(j, "direction").normalized();
        fitted.light = {estimate.reference_point_m - d * direction, direction,
                        j.number("angular_radius_rad") * d,
                        read_rgb(j, "irradiance_w_per_m2") * static_cast<float>(d * d)};
    }
    fitted.stddev_direction_deg = j.number_or("stddev_direction_deg", 0.0);
    fitted.stddev_distance_m = j.number_or("stddev_distance_m", 0.0);
    fitted.stddev_radius_m = j.number_or("stddev_radius_m", 0.0);
    fitted.stddev_intensity_ratio = j.number_or("stddev_intensity_ratio", 0.0);
    fitted.stddev_irradiance_ratio = j.number_or("stddev_irradiance_ratio", 0.0);
    fitted.is_distant = j.boolean_or("is_distant", false);
    fitted.outcome = j.has("outcome") ? outcome_from_name(j.choice("outcome", kOutcomeWords))
                                      : Outcome::Converged;
    fitted.reason = j.text_or("reason", "");
    j.ignore_rest();
    return fitted;
}

}  // namespace

void write_estimate(const std::filesystem::path& path, const SceneEstimate& estimate) {
    const LightEstimate& light = estimate.light;
    Json j;
    j["schema"] = "vitrine.estimate/1";
    j["method"] = method_name(estimate.method);
    j["reference_point_m"] = to_json(light.reference_point_m);
    j["support_plane"] = {{"normal", to_json(light.plane.normal)},
                          {"offset_m", light.plane.offset}};
    j["scene_radius_m"] = light.scene_radius_m;
    j["lights"] = Json::array();
    for (const FittedLight& fitted : light.lights) j["lights"].push_back(light_json(fitted, light));
    j["lights_outcome"] = outcome_name(light.outcome);
    if (!light.reason.empty()) j["lights_reason"] = light.reason;
    j["grid_direction"] = to_json(light.grid_direction);
    j["ambient_radiance"] = to_json(light.ambient_radiance);
    j["albedo_anchor"] = light.albedo_anchor;
    j["objects"] = Json::array();
    for (const ObjectEstimate& object : estimate.objects)
        j["objects"].push_back(object_json(object));
    j["photometric_error"] = {{"initial", estimate.error_initial}, {"joint", estimate.error_joint}};
    write_json_file(path, j);
}

SceneEstimate read_estimate(const std::filesystem::path& path) {
    const JsonObject j = read_json_file(path);
    j.choice("schema", {"vitrine.estimate/1"});
    SceneEstimate estimate;
    if (j.has("method"))
        estimate.method =
            method_from_name(j.choice("method", {"default", "paper", "local", "inverse-photon"}));
    LightEstimate& light = estimate.light;
    light.reference_point_m = read_vec3(j, "reference_point_m");
    if (j.has("support_plane")) {
        const JsonObject plane = j.object("support_plane");
        light.plane.normal = read_vec3(plane, "normal");
        light.plane.offset = plane.number("offset_m");
    }
    light.scene_radius_m = j.number_or("scene_radius_m", 0.5);
    for (const JsonObject& l : j.objects("lights"))
        light.lights.push_back(read_fitted_light(l, light));
    light.outcome = j.has("lights_outcome")
                        ? outcome_from_name(j.choice("lights_outcome", kOutcomeWords))
                        : Outcome::Converged;
    light.reason = j.text_or("lights_reason", "");
    if (j.has("grid_direction")) light.grid_direction = read_vec3(j, "grid_direction");
    light.ambient_radiance = read_rgb(j, "ambient_radiance");
    light.albedo_anchor = j.text_or("albedo_anchor", "mean_albedo");
    for (const JsonObject& object : j.objects("objects"))
        estimate.objects.push_back(read_object(object));
    if (j.has("photometric_error")) {
        const JsonObject error = j.object("photometric_error");
        estimate.error_initial = error.number_or("initial", 0.0);
        estimate.error_joint = error.number_or("joint", 0.0);
    }
    j.ignore_rest();
    return estimate;
}

Overrides read_overrides(const std::filesystem::path& path) {
    const JsonObject j = read_json_file(path);
    Overrides overrides;
    if (j.has("objects"))
        for (const JsonObject& o : j.objects("objects")) {
            ObjectOverride object;
            object.id = o.text("id");
            if (o.has("class"))
                object.object_class = class_from_name(o.choice("class", kClassWords));
            if (o.has("ior")) {
                object.ior = o.number("ior");
                if (!(*object.ior >= 1.0 && *object.ior <= 4.0))
                    o.fail("ior", "an index of refraction from 1 to 4",
                           std::to_string(*object.ior));
            }
            if (o.has("sigma_a_per_m")) {
                object.sigma_a_per_m = read_rgb(o, "sigma_a_per_m");
                if ((*object.sigma_a_per_m < 0.0f).any())
                    o.fail("sigma_a_per_m", "three numbers of at least 0", "a negative one");
            }
            object.ignore = o.boolean_or("ignore", false);
            o.finish();
            overrides.objects.push_back(object);
        }
    if (j.has("lights"))
        for (const JsonObject& l : j.objects("lights"))
            overrides.lights.push_back(read_light(l, path.parent_path()));
    j.finish();
    return overrides;
}

}  // namespace vitrine
