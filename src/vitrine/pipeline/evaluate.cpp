#include "pipeline/evaluate.h"

#include "base/json_reader.h"
#include "geometry/mesh_io.h"
#include "image/image_io.h"
#include "pipeline/insertion_measure.h"
#include "scene/scene_json.h"

#include <cmath>
#include <limits>
#include <set>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

struct TrueLight {
    Vec3 position_m;
    Rgb intensity;
    double radius_m = 0.0;
};

struct TrueObject {
    std::string name, object_class;
    Box3 box;
    JsonObject material;
};

struct FoundLight {
    Vec3 direction;           ///< from the reference point to the light
    double distance_m = 0.0;  ///< 0: directional
    Rgb intensity = Rgb::Zero();
    double radius_m = 0.0;
};

std::string numbers(const Rgb& a) {
    return fmt::format("({:.3g}, {:.3g}, {:.3g})", a[0], a[1], a[2]);
}

double elevation_deg(const Vec3& direction) {
    return degrees(std::asin(direction.normalized().z()));
}

std::vector<FoundLight> read_found_lights(const JsonObject& estimate, const Vec3& reference) {
    std::vector<FoundLight> lights;
    for (const JsonObject& item : estimate.objects("lights")) {
        FoundLight light;
        if (item.has("position_m")) {
            const Vec3 offset = read_vec3(item, "position_m") - reference;
            light.direction = offset.normalized();
            light.distance_m = offset.norm();
            light.intensity = read_rgb(item, "intensity_w_per_sr");
            light.radius_m = item.number_or("radius_m", 0.0);
        } else {
            light.direction = -read_vec3(item, "direction").normalized();
        }
        lights.push_back(light);
    }
    return lights;
}

void compare_lights(const JsonObject& truth, const JsonObject& estimate, Evaluation& evaluation) {
    const Vec3 reference =
        truth.has("reference_point") ? read_vec3(truth, "reference_point") : Vec3::Zero();
    std::vector<TrueLight> lights;
    for (const JsonObject& item : truth.objects("lights")) {
        lights.push_back({read_vec3(item, "centre"), read_rgb(item, "point_intensity_W_sr"),
                          item.number_or("radius", 0.0)});
    }
    std::vector<FoundLight> found = read_found_lights(estimate, reference);
    evaluation.rows.push_back(
        {"lights", "count_difference",
         static_cast<double>(found.size()) - static_cast<double>(lights.size()),
         fmt::format("{} found, {} true", found.size(), lights.size())});
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Vec3 offset = lights[i].position_m - reference;
        std::size_t best = found.size();
        double best_angle = std::numeric_limits<double>::infinity();
        for (std::size_t j = 0; j < found.size(); ++j) {
            const double angle = angle_between(offset, found[j].direction);
            if (angle < best_angle) {
                best_angle = angle;
                best = j;
            }
        }
        const std::string subject = fmt::format("light {}", i);
        if (best == found.size()) {
            evaluation.rows.push_back({subject, "is_missing", 1.0, "no light left to match"});
            continue;
        }
        const FoundLight light = found[best];
        found.erase(found.begin() + static_cast<std::ptrdiff_t>(best));
        const auto add = [&](const char* quantity, double value, std::string detail) {
            evaluation.rows.push_back({subject, quantity, value, std::move(detail)});
        };
        add("direction_error_deg", degrees(best_angle), "full angle seen from the reference point");
        add("elevation_error_deg", std::abs(elevation_deg(light.direction) - elevation_deg(offset)),
            fmt::format("{:.2f} against {:.2f}", elevation_deg(light.direction),
                        elevation_deg(offset)));
        if (light.distance_m > 0) {
            add("distance_error_percent", 100 * (light.distance_m / offset.norm() - 1),
                fmt::format("{:.3f} m against {:.3f} m", light.distance_m, offset.norm()));
            add("intensity_error_percent",
                100 * ((light.intensity / lights[i].intensity).mean() - 1),
                numbers(light.intensity) + " against " + numbers(lights[i].intensity));
            add("radius_error_percent",
                lights[i].radius_m > 0 ? 100 * (light.radius_m / lights[i].radius_m - 1) : 0.0,
                fmt::format("{:.3f} m against {:.3f} m", light.radius_m, lights[i].radius_m));
        }
    }
}

std::vector<TrueObject> read_true_objects(const JsonObject& truth) {
    std::vector<TrueObject> objects;
    for (const JsonObject& item : truth.objects("objects")) {
        if (!item.has("bbox_min")) continue;
        Box3 box;
        box.extend(read_vec3(item, "bbox_min"));
        box.extend(read_vec3(item, "bbox_max"));
        objects.push_back({item.text("name"), item.text("class"), box, item.object("material")});
    }
    return objects;
}

/// Of the estimated object's box, how much is shared with the true one (intersection over union).
double box_overlap(const Box3& a, const Box3& b) {
    const Vec3 low = a.min.cwiseMax(b.min), high = a.max.cwiseMin(b.max);
    if ((high.array() <= low.array()).any()) return 0.0;
    const double both = (high - low).prod();
    return both / (a.size().prod() + b.size().prod() - both);
}

void compare_transparent(const JsonObject& found, const JsonObject& material,
                         const std::string& subject, Evaluation& evaluation) {
    const auto add = [&](const std::string& quantity, double value, std::string detail) {
        evaluation.rows.push_back({subject, quantity, value, std::move(detail)});
    };
    const JsonObject ior = found.object("ior");
    const double value = ior.number("value");
    add("ior_error", value - material.number("ior"),
        fmt::format("{:.4f} +- {:.4f} against {:.4f}, {}", value, ior.number_or("stddev", 0.0),
                    material.number("ior"), ior.text("outcome")));
    const JsonObject absorption = found.object("sigma_a_per_m");
    const Rgb sigma = read_rgb(absorption, "value");
    const Rgb truth = material.has("sigma_a_per_metre") ? read_rgb(material, "sigma_a_per_metre")
                                                        : Rgb(Rgb::Zero());
    const char* channels[] = {"red", "green", "blue"};
    for (int c = 0; c < 3; ++c) {
        add(fmt::format("sigma_a_error_per_m_{}", channels[c]), sigma[c] - truth[c],
            fmt::format("{:.2f} against {:.2f} 1/m, {}", sigma[c], truth[c],
                        absorption.text("outcome")));
    }
}

void compare_specular(const JsonObject& found, const JsonObject& material,
                      const std::string& subject, Evaluation& evaluation) {
    const std::vector<JsonObject> clusters = found.objects("clusters");
    if (clusters.empty()) return;
    std::size_t largest = 0;
    for (std::size_t i = 1; i < clusters.size(); ++i) {
        if (clusters[i].number("area_fraction") > clusters[largest].number("area_fraction"))
            largest = i;
    }
    const JsonObject& cluster = clusters[largest];
    const auto add = [&](const char* quantity, double value, std::string detail) {
        evaluation.rows.push_back({subject, quantity, value, std::move(detail)});
    };
    const double sigma = cluster.number("sigma"), alpha = material.number("beckmann_alpha");
    add("sigma_ratio", sigma / alpha,
        fmt::format("{:.4f} against {:.4f}, {}", sigma, alpha, cluster.text("outcome")));
    const Rgb rho_d = read_rgb(cluster, "rho_d"), rho_s = read_rgb(cluster, "rho_s");
    const Rgb true_d = read_rgb(material, "rho_d"), true_s = read_rgb(material, "rho_s");
    add("rho_d_error_percent", 100 * ((rho_d / true_d).mean() - 1),
        numbers(rho_d) + " against " + numbers(true_d));
    add("rho_s_error_percent", 100 * ((rho_s / true_s).mean() - 1),
        numbers(rho_s) + " against " + numbers(true_s));
}

void compare_objects(const fs::path& workspace, const JsonObject& truth, const JsonObject& estimate,
                     Evaluation& evaluation) {
    constexpr double kMinOverlap = 0.2;
    const std::vector<TrueObject> objects = read_true_objects(truth);
    std::set<std::string> matched;
    int wrong = 0;
    for (const JsonObject& item : estimate.objects("objects")) {
        const std::string id = item.text("id");
        const Box3 box = bounds(read_mesh(workspace / item.text("mesh")));
        const TrueObject* match = nullptr;
        double best = kMinOverlap;
        for (const TrueObject& object : objects) {
            const double overlap = box_overlap(box, object.box);
            if (overlap > best && matched.count(object.name) == 0) {
                best = overlap;
                match = &object;
            }
        }
        const std::string found_class = item.text("class");
        const std::string true_class = match ? match->object_class : "diffuse";
        const std::string subject = fmt::format("{} ({})", id, match ? match->name : "nothing");
        if (match) matched.insert(match->name);
        const bool is_right = found_class == true_class;
        wrong += is_right ? 0 : 1;
        evaluation.rows.push_back({subject, "is_class_right", is_right ? 1.0 : 0.0,
                                   fmt::format("{} against {}, margin {:.2f}", found_class,
                                               true_class, item.number_or("class_margin", 0.0))});
        if (!match || !is_right) continue;
        if (true_class == "transparent")
            compare_transparent(item, match->material, subject, evaluation);
        if (true_class == "specular") compare_specular(item, match->material, subject, evaluation);
    }
    int missing = 0;
    for (const TrueObject& object : objects) {
        if (object.object_class == "diffuse" || matched.count(object.name) > 0) continue;
        ++missing;
        evaluation.rows.push_back(
            {object.name, "is_missing", 1.0, object.object_class + ", not found"});
    }
    evaluation.rows.push_back({"objects", "missing", static_cast<double>(missing), ""});
    evaluation.rows.push_back({"objects", "wrong_class", static_cast<double>(wrong), ""});
}

void add_insertion_rows(const std::string& subject, const InsertionError& error,
                        Evaluation& evaluation) {
    const auto add = [&](const char* region, double value, double floor) {
        evaluation.rows.push_back({subject, std::string(region) + "_error", value,
                                   fmt::format("noise floor of the truth {:.3f}", floor)});
    };
    add("object", error.object, error.object_floor);
    add("darker", error.darker, error.darker_floor);
    add("brighter", error.brighter, error.brighter_floor);
    add("changed", error.changed, error.changed_floor);
    add("all", error.all, error.all_floor);
}

void compare_insertions(const fs::path& workspace, const fs::path& truth_folder,
                        double saturation_level, Evaluation& evaluation) {
    const fs::path insert = truth_folder / "insert";
    if (!fs::is_directory(insert) || !fs::is_directory(workspace / "50_insert")) return;
    std::set<std::string> frames;
    for (const auto& entry : fs::directory_iterator(insert)) {
        const std::string name = entry.path().filename().string();
        const std::size_t end = name.find("_with.exr");
        if (end != std::string::npos) frames.insert(name.substr(0, end));
    }
    std::vector<InsertionError> errors;
    for (const std::string& frame : frames) {
        const fs::path with = workspace / "50_insert" / (frame + "_with.exr");
        const fs::path without = workspace / "50_insert" / (frame + "_without.exr");
        const fs::path plain = truth_folder / "linear" / (frame + ".exr");
        if (!fs::exists(with) || !fs::exists(without) || !fs::exists(plain)) continue;
        const ImageRgb true_with = read_exr_rgb(insert / (frame + "_with.exr"));
        const ImageRgb true_without = read_exr_rgb(plain);
        const Mask mask = read_mask(insert / (frame + "_virtual_mask.png"));
        errors.push_back(measure_insertion(true_with, true_without, read_exr_rgb(with),
                                           read_exr_rgb(without), mask, saturation_level));
        add_insertion_rows("insertion " + frame, errors.back(), evaluation);
        const fs::path composite = workspace / "60_composite" / (frame + ".exr");
        if (fs::exists(composite)) {
            // The finished picture against the true one: the plate's own noise counts here too.
            add_insertion_rows("composite " + frame,
                               measure_insertion(true_with, true_without, read_exr_rgb(composite),
                                                 true_without, mask, saturation_level),
                               evaluation);
        }
    }
    if (errors.empty()) return;
    InsertionError mean;
    for (const InsertionError& e : errors) {
        const double share = 1.0 / static_cast<double>(errors.size());
        mean.object += share * e.object;
        mean.darker += share * e.darker;
        mean.brighter += share * e.brighter;
        mean.changed += share * e.changed;
        mean.all += share * e.all;
    }
    add_insertion_rows("insertion, mean", mean, evaluation);
}

}  // namespace

std::string Evaluation::text() const {
    std::string text;
    for (const EvaluationRow& row : rows) {
        text += fmt::format("{:<28} {:<26} {:>10.4g}  {}\n", row.subject, row.quantity, row.value,
                            row.detail);
    }
    return text;
}

std::string Evaluation::json() const {
    Json list = Json::array();
    for (const EvaluationRow& row : rows) {
        list.push_back({{"subject", row.subject},
                        {"quantity", row.quantity},
                        {"value", row.value},
                        {"detail", row.detail}});
    }
    return Json({{"schema", "vitrine.evaluation/1"}, {"rows", list}}).dump(2);
}

double Evaluation::value(const std::string& subject_prefix, const std::string& quantity) const {
    for (const EvaluationRow& row : rows) {
        if (row.subject.rfind(subject_prefix, 0) == 0 && row.quantity == quantity) return row.value;
    }
    return std::numeric_limits<double>::quiet_NaN();
}

Evaluation evaluate_workspace(const fs::path& workspace, const fs::path& truth_scene) {
    const JsonObject truth = read_json_file(truth_scene);
    const JsonObject estimate = read_json_file(workspace / "estimate.json");
    Evaluation evaluation;
    compare_lights(truth, estimate, evaluation);
    compare_objects(workspace, truth, estimate, evaluation);
    const double saturation =
        truth.has("exposure") ? truth.object("exposure").number_or("scale", 1.0) : 1.0;
    compare_insertions(workspace, truth_scene.parent_path(), saturation, evaluation);
    return evaluation;
}

}  // namespace vitrine
