#include "base/file.h"
#include "base/json_reader.h"
#include "image/image_io.h"
#include "pipeline/transfer_recipe.h"

namespace vitrine {
namespace {

Json triple(double a, double b, double c) { return Json::array({a, b, c}); }

Json per_channel(const MediumEstimate& medium, double TwoExponentials::*member) {
    return triple(medium.fit[0].*member, medium.fit[1].*member, medium.fit[2].*member);
}

}  // namespace

void write_material_json(const std::filesystem::path& path, const MediumEstimate& medium,
                         double scale_px_per_m) {
    Json json;
    json["schema"] = "vitrine.translucent/1";
    const RadialProfile profile = medium.profile();
    Json radii = Json::array(), values = Json::array();
    for (std::size_t i = 0; i < profile.r.size(); ++i) {
        radii.push_back(profile.r[i]);
        values.push_back(triple(profile.rd[i][0], profile.rd[i][1], profile.rd[i][2]));
    }
    json["profile"] = {{"r_px", radii}, {"rd_per_px2", values}};
    json["fit"]["a"] = per_channel(medium, &TwoExponentials::a);
    json["fit"]["b"] = per_channel(medium, &TwoExponentials::b);
    json["fit"]["c"] = per_channel(medium, &TwoExponentials::c);
    json["fit"]["d"] = per_channel(medium, &TwoExponentials::d);
    json["eta"] = medium.eta;
    json["inradius_px"] = medium.inradius_px;
    const bool is_metric = scale_px_per_m > 0;
    json["scale_px_per_m"] = is_metric ? Json(scale_px_per_m) : Json(nullptr);
    const bool has_dipole = medium.dipole[0] && medium.dipole[1] && medium.dipole[2];
    if (is_metric && has_dipole) {
        Json absorption = Json::array(), scattering = Json::array();
        for (const auto& dipole : medium.dipole) {
            absorption.push_back(dipole->sigma_a * scale_px_per_m);
            scattering.push_back(dipole->sigma_s_prime * scale_px_per_m);
        }
        json["dipole"] = {{"sigma_a_per_m", absorption}, {"sigma_s_prime_per_m", scattering}};
    } else {
        json["dipole"] = nullptr;
    }
    Json channels = Json::array();
    for (const ChannelFit& channel : medium.channels) {
        channels.push_back({{"albedo", channel.albedo},
                            {"mean_radius_px", channel.mean_radius_px},
                            {"relative_residual", channel.relative_residual},
                            {"outcome", outcome_name(channel.outcome)},
                            {"reason", channel.reason}});
    }
    json["channels"] = channels;
    write_json_file(path, json);
}

StoredMaterial read_material_json(const std::filesystem::path& path) {
    const JsonObject object = read_json_file(path);
    object.choice("schema", {"vitrine.translucent/1"});
    StoredMaterial stored;
    MediumEstimate& medium = stored.medium;
    medium.eta = object.number_or("eta", 1.3);
    medium.inradius_px = object.number("inradius_px");
    if (medium.inradius_px <= 0)
        object.fail("inradius_px", "a number > 0", fmt::format("{}", medium.inradius_px));
    if (object.has("scale_px_per_m") && object.raw("scale_px_per_m").is_number())
        stored.scale_px_per_m = object.number("scale_px_per_m");
    const JsonObject fit = object.object("fit");
    const std::vector<double> a = fit.numbers("a", 3), b = fit.numbers("b", 3);
    const std::vector<double> c = fit.numbers("c", 3), d = fit.numbers("d", 3);
    fit.finish();
    for (std::size_t k = 0; k < 3; ++k) {
        if (a[k] < 0) fit.fail("a", "numbers >= 0", fmt::format("{}", a[k]));
        if (c[k] < 0) fit.fail("c", "numbers >= 0", fmt::format("{}", c[k]));
        if (b[k] >= 0) fit.fail("b", "numbers < 0", fmt::format("{}", b[k]));
        if (d[k] >= 0) fit.fail("d", "numbers < 0", fmt::format("{}", d[k]));
        medium.fit[k] = {a[k], b[k], c[k], d[k]};
        medium.channels[k].albedo = medium.fit[k].total();
        medium.channels[k].mean_radius_px = medium.fit[k].mean_radius();
    }
    object.ignore_rest();
    return stored;
}

void write_lights_json(const std::filesystem::path& path, const PhotoAnalysis& analysis) {
    Json json;
    json["schema"] = "vitrine.view_lights/1";
    json["frame"] = "viewer: x right, y up, z toward the viewer";
    const auto list = [](const auto& lights) {
        Json items = Json::array();
        for (const auto& light : lights) {
            items.push_back({{"direction", triple(light.direction.x(), light.direction.y(),
                                                  light.direction.z())},
                             {"irradiance",
                              triple(light.intensity[0], light.intensity[1], light.intensity[2])}});
        }
        return items;
    };
    const auto write_estimate = [&](Json& to, const ViewLightsEstimate& estimate) {
        const Rgbd &ambient = estimate.lights.ambient, &below = estimate.lights.from_below;
        to["lights"] = list(estimate.lights.lights);
        to["ambient_irradiance"] = triple(ambient[0], ambient[1], ambient[2]);
        to["from_below_irradiance"] = triple(below[0], below[1], below[2]);
        if (analysis.relief.is_cluster()) {
            const Rgbd& balls = estimate.ball_albedo;
            to["ball_albedo"] = triple(balls[0], balls[1], balls[2]);
        }
        to["relative_residual"] = estimate.relative_residual;
        to["outcome"] = outcome_name(estimate.outcome);
        to["reason"] = estimate.reason;
    };
    write_estimate(json, analysis.lights);
    json["highlight_lights"] = list(analysis.highlight_lights);
    // Under which R_d is read (compose/transfer.h).
    write_estimate(json["explaining"], analysis.explaining);
    write_json_file(path, json);
}

void write_relief_exr(const std::filesystem::path& path, const Relief& relief) {
    ExrImage exr;
    exr.width = relief.mask.width();
    exr.height = relief.mask.height();
    exr.channels["Z"] = relief.depth_px;
    const char* const names[3] = {"normal.X", "normal.Y", "normal.Z"};
    for (int c = 0; c < 3; ++c) {
        ImageF plane(exr.width, exr.height);
        for (std::size_t i = 0; i < plane.size(); ++i)
            plane[i] = relief.mask[i] > 127 ? relief.normals[i][c] : 0.0f;
        exr.channels[names[c]] = plane;
    }
    exr.attributes["frame"] = "viewer: x right, y up, z toward the viewer; Z in pixels";
    write_exr(path, exr);
}

}  // namespace vitrine
