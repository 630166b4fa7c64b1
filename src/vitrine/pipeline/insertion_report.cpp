// The report of an insertion run, from the files of its workspace alone.
#include "base/file.h"
#include "base/json_reader.h"
#include "pipeline/report.h"
#include "scene/scene_json.h"

#include <algorithm>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

std::string row(std::initializer_list<std::string> cells) {
    std::string text = "<tr>";
    for (const std::string& cell : cells) text += "<td>" + cell + "</td>";
    return text + "</tr>\n";
}

std::string three(const Rgb& v) { return fmt::format("{:.3g}, {:.3g}, {:.3g}", v[0], v[1], v[2]); }

std::string outcome_words(const JsonObject& estimate) {
    const std::string outcome = estimate.text("outcome");
    const std::string reason = estimate.text_or("reason", "");
    return fmt::format("<span class=\"{}\">{}</span>{}", outcome == "converged" ? "good" : "bad",
                       outcome, reason.empty() ? "" : ": " + escape_html(reason));
}

std::string light_rows(const JsonObject& estimate) {
    std::string text;
    int index = 0;
    for (const JsonObject& light : estimate.objects("lights")) {
        std::string where, strength;
        if (light.has("position_m")) {
            const Vec3 p = read_vec3(light, "position_m");
            where = fmt::format("at ({:.3f}, {:.3f}, {:.3f}) m", p.x(), p.y(), p.z());
            strength = three(read_rgb(light, "intensity_w_per_sr")) + " W/sr";
            if (light.has("radius_m"))
                where += fmt::format(", radius {:.3f} m", light.number("radius_m"));
        } else {
            const Vec3 d = read_vec3(light, "direction");
            where =
                fmt::format("from far, travelling ({:.3f}, {:.3f}, {:.3f})", d.x(), d.y(), d.z());
            strength = three(read_rgb(light, "irradiance_w_per_m2")) + " W/m2";
        }
        text +=
            row({fmt::format("light {}", index++), escape_html(light.text("kind")), where, strength,
                 fmt::format("direction +- {:.2f} degrees",
                             light.number_or("stddev_direction_deg", 0.0))});
    }
    text += row({"surroundings", "ambient", "",
                 three(read_rgb(estimate, "ambient_radiance")) + " W/(m2 sr)", ""});
    return text;
}

std::string object_rows(const JsonObject& object) {
    std::string text;
    const std::string id = escape_html(object.text("id"));
    const std::string kind = object.text("class");
    text += row({id, kind + (object.boolean_or("hollow", false) ? ", hollow" : ""),
                 fmt::format("margin {:.2f}", object.number_or("class_margin", 0.0)), "", ""});
    if (object.has("ior")) {
        const JsonObject ior = object.object("ior");
        text += row({"", "refractive index", fmt::format("{:.3f}", ior.number("value")),
                     fmt::format("+- {:.3f}", ior.number_or("stddev", 0.0)), outcome_words(ior)});
    }
    if (object.has("sigma_a_per_m")) {
        const JsonObject absorption = object.object("sigma_a_per_m");
        text += row({"", "absorption, 1/m", three(read_rgb(absorption, "value")),
                     "+- " + three(read_rgb(absorption, "stddev")), outcome_words(absorption)});
    }
    if (object.has("wall_m")) {
        const JsonObject wall = object.object("wall_m");
        text += row({"", "wall", fmt::format("{:.1f} mm", 1e3 * wall.number("value")),
                     fmt::format("+- {:.1f} mm", 1e3 * wall.number_or("stddev", 0.0)),
                     outcome_words(wall)});
    }
    if (object.has("clusters")) {
        for (const JsonObject& cluster : object.objects("clusters")) {
            text +=
                row({"",
                     fmt::format("Ward, {:.0f} % of the surface",
                                 100 * cluster.number("area_fraction")),
                     "diffuse " + three(read_rgb(cluster, "rho_d")) + "; specular " +
                         three(read_rgb(cluster, "rho_s")),
                     fmt::format("sigma {:.3f}", cluster.number("sigma")), outcome_words(cluster)});
        }
    }
    return text;
}

std::vector<double> project(const JsonObject& camera, const Vec3& p) {
    const Camera c = read_camera(camera);
    const Vec2 pixel = c.project(p);
    return {pixel.x(), pixel.y(), c.depth(p)};
}

/// The light as an arrow in the picture, from the reference point toward it.
std::string light_overlay(const fs::path& plate, const JsonObject& camera,
                          const JsonObject& estimate) {
    const Vec3 reference = read_vec3(estimate, "reference_point_m");
    const double width = camera.number("width"), height = camera.number("height");
    std::string arrows;
    for (const JsonObject& light : estimate.objects("lights")) {
        const Vec3 direction = light.has("position_m")
                                   ? Vec3(read_vec3(light, "position_m") - reference).normalized()
                                   : Vec3(-read_vec3(light, "direction").normalized());
        constexpr double kArrow_m = 0.15;
        const std::vector<double> from = project(camera, reference);
        const std::vector<double> to = project(camera, reference + kArrow_m * direction);
        // Its foot on the plane through the reference point tells a high light from a low one.
        const std::vector<double> foot =
            project(camera, reference + kArrow_m * Vec3(direction.x(), direction.y(), 0));
        if (from[2] <= 0 || to[2] <= 0) continue;
        arrows += fmt::format(
            "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}\" fill=\"none\" stroke=\"#ff0\" "
            "stroke-dasharray=\"4 4\" stroke-width=\"1.5\"/>"
            "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#ff0\" "
            "stroke-width=\"3\"/><circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"8\" fill=\"#ff0\" "
            "stroke=\"#000\"/>",
            from[0], from[1], foot[0], foot[1], to[0], to[1], from[0], from[1], to[0], to[1], to[0],
            to[1]);
    }
    return fmt::format(
        "<figure><svg viewBox=\"0 0 {} {}\" width=\"{}\" style=\"max-width:100%\" role=\"img\" "
        "aria-label=\"light over the scene\"><image href=\"{}\" width=\"{}\" "
        "height=\"{}\"/>{}</svg>"
        "<figcaption>From the middle of the scene toward each light (15 cm of the way); dashed: "
        "its "
        "shadow on the table and its height.</figcaption></figure>\n",
        width, height, width, png_data_url(plate), width, height, arrows);
}

fs::path plate_path(const fs::path& workspace, const std::string& frame) {
    return workspace / "60_composite" / (frame + "_plate.png");
}

}  // namespace

void write_insertion_report(const fs::path& workspace, const std::string& capture_name,
                            const std::vector<std::string>& warnings) {
    const JsonObject estimate = read_json_file(workspace / "estimate.json");
    std::string body = "<h1>" + escape_html(capture_name) + "</h1>\n";
    for (const std::string& warning : warnings) {
        body += "<p class=\"note\">" + escape_html(warning) + "</p>\n";
    }
    const fs::path list = workspace / "60_composite" / "frames.json";
    if (fs::exists(list)) {
        const JsonObject frames = read_json_file(list);
        body += "<h2>Pictures: as captured, and with the virtual object</h2>\n";
        const std::vector<JsonObject> list_of_frames = frames.objects("frames");
        for (const JsonObject& frame : list_of_frames) {
            const std::string id = frame.text("id");
            body += comparison_html("frame-" + id, {"frame " + id, plate_path(workspace, id),
                                                    workspace / "60_composite" / (id + ".png")});
        }
        const JsonObject& first = list_of_frames.front();
        body += "<h2>The light</h2>\n" + light_overlay(plate_path(workspace, first.text("id")),
                                                       first.object("camera"), estimate);
    }
    body +=
        "<h2>What was measured</h2>\n<table><tr><th></th><th>kind</th><th>value</th><th></th>"
        "<th>certainty</th></tr>\n" +
        light_rows(estimate);
    const std::vector<JsonObject> objects = estimate.objects("objects");
    for (const JsonObject& object : objects) body += object_rows(object);
    body += "</table>\n";
    if (estimate.text_or("lights_outcome", "converged") != "converged")
        body += fmt::format("<p class=\"note\">The light is {}: {}.</p>\n",
                            estimate.text("lights_outcome"),
                            escape_html(estimate.text_or("lights_reason", "no reason given")));
    if (objects.empty() && estimate.objects("lights").empty()) {
        body += "<p class=\"note\">Without a light no material was measured.</p>\n";
    } else if (objects.empty()) {
        body +=
            "<p class=\"note\">No glass or metal was found: a valid scene, with diffuse things "
            "only.</p>\n";
    }
    if (estimate.text_or("albedo_anchor", "") == "mean_albedo") {
        body +=
            "<p class=\"note\">No reference albedo was given: light strengths and albedos are "
            "known "
            "up to one common factor (a mean albedo of 0.5 was assumed).</p>\n";
    }
    const fs::path run = workspace / "run.json";
    if (fs::exists(run)) {
        const JsonObject record = read_json_file(run);
        const JsonObject stages = record.object("stages");
        body +=
            "<h2>Stages</h2>\n<table><tr><th>stage</th><th>seconds</th><th>peak memory, "
            "MB</th></tr>\n";
        for (const char* name : {"reconstruct", "candidates", "lights", "materials", "insert"}) {
            if (!stages.has(name)) continue;
            const JsonObject stage = stages.object(name);
            body += row({name, fmt::format("{:.1f}", stage.number("seconds")),
                         fmt::format("{:.0f}", stage.number("peak_mb"))});
        }
        body += "</table>\n";
    }
    write_text_file(workspace / "report.html", html_page("Vitrine: " + capture_name, body));
}

}  // namespace vitrine
