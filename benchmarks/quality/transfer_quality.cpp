// Prints every quality figure of the material transfer: against path-traced photographs of known
// shape, light, material and result (first argument: their folder), and against worlds made here.
//
//   vitrine_transfer_quality PHOTOS [--dump DIR] [--lights lopez-moreno] [--solver qmr]
#include "base/file.h"
#include "base/json_reader.h"
#include "base/timer.h"
#include "compose/transfer.h"
#include "estimate/back_surface.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "image/poisson.h"
#include "math/statistics.h"
#include "render/render_object.h"
#include "transfer_measures.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>

using namespace vitrine;
namespace fs = std::filesystem;

namespace {

/// A lamp of the truth: an evenly emitting disc at a finite distance, facing the object's centre.
struct NearLamp {
    Vec3 position_px = Vec3::Zero();  ///< viewer frame of the relief
    Vec3 direction = Vec3::Zero();    ///< unit, from the object's centre toward it
    Rgbd irradiance = Rgbd::Zero();   ///< at the object's centre, facing it, units of the photo
    double distance_px = 1;
};

struct TruthPhoto {
    std::string name;
    Photo photo;
    Relief relief;      ///< true normals, depth over the middle surface
    ViewLights lights;  ///< true, normalised
    ImageF height_px;   ///< true, above the object's centre
    std::vector<NearLamp> lamps;
    Rgbd ambient = Rgbd::Zero();  ///< irradiance, units of the photo
    Rgbd ground = Rgbd::Zero();   ///< radiance of what lies around the object's lower half, as seen
    double px_per_m = 0;
    double exposure_scale = 1;
    std::string material;
    RadialProfile profile_mm;  ///< of translucent ones
};

RadialProfile read_profile_csv(const fs::path& path) {
    const std::string text = read_text_file(path);
    std::map<double, Rgbd> rows;
    std::size_t begin = 0;
    while (begin < text.size()) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        const std::string line = text.substr(begin, end - begin);
        begin = end + 1;
        char channel = 0;
        double r_in, r_out, r_mid, rd;
        if (std::sscanf(line.c_str(), "%c,%lf,%lf,%lf,%lf", &channel, &r_in, &r_out, &r_mid, &rd) !=
            5)
            continue;
        const int c = channel == 'R' ? 0 : channel == 'G' ? 1 : 2;
        rows.try_emplace(std::round(r_mid * 1e4) / 1e4, Rgbd::Zero()).first->second[c] = rd;
    }
    // Channels have their own bins: resample each on a common grid.
    RadialProfile channels[3];
    for (const auto& [r, rd] : rows)
        for (int c = 0; c < 3; ++c)
            if (rd[c] > 0) {
                channels[c].r.push_back(r);
                channels[c].rd.push_back(Rgbd::Constant(rd[c]));
            }
    RadialProfile profile;
    for (int i = 0; i < 400; ++i) {
        const double r = 0.02 * std::pow(60.0 / 0.02, i / 399.0);
        profile.r.push_back(r);
        profile.rd.push_back(
            Rgbd(channels[0].at(r)[0], channels[1].at(r)[0], channels[2].at(r)[0]));
    }
    return profile;
}

/// Mean radiance around the lower half of the object: the table, as the photo shows it.
Rgbd surroundings_below(const ImageRgb& picture, const Relief& relief) {
    const ImageF away = distance_to(relief.mask);
    double rows = 0, inside = 0, count = 0;
    for (int y = 0; y < picture.height(); ++y) {
        for (int x = 0; x < picture.width(); ++x) {
            if (!is_inside(relief.mask, x, y)) continue;
            rows += y;
            inside += 1;
        }
    }
    Rgbd sum = Rgbd::Zero();
    for (int y = static_cast<int>(rows / inside); y < picture.height(); ++y) {
        for (int x = 0; x < picture.width(); ++x) {
            if (away(x, y) <= 3 || away(x, y) > 1.5 * relief.inradius_px) continue;
            sum += picture(x, y).cast<double>();
            count += 1;
        }
    }
    return sum / std::max(count, 1.0);
}

/// The balls of a cluster that the photo shows, moved to where the true depth and normals have
/// them: p - R n is one point for all pixels of a ball.
Relief true_cluster(const TruthPhoto& truth, const Relief& found) {
    std::vector<Ball> balls;
    for (std::size_t k = 0; k < found.balls.size(); ++k) {
        Vec3 p_mean = Vec3::Zero(), n_mean = Vec3::Zero();
        std::vector<Vec3> points, normals;
        for (int y = 0; y < found.mask.height(); ++y) {
            for (int x = 0; x < found.mask.width(); ++x) {
                if (found.ball_of(x, y) != static_cast<std::int16_t>(k)) continue;
                const Vec2 v(x - found.balls[k].centre_px.x(), -y - found.balls[k].centre_px.y());
                if (v.norm() > 0.85 * found.balls[k].radius_px) continue;
                points.emplace_back(x, -y, truth.height_px(x, y));
                normals.push_back(truth.relief.normals(x, y).cast<double>());
                p_mean += points.back();
                n_mean += normals.back();
            }
        }
        if (points.size() < 50) continue;
        p_mean /= static_cast<double>(points.size());
        n_mean /= static_cast<double>(points.size());
        double above = 0, below = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            above += (points[i] - p_mean).dot(normals[i] - n_mean);
            below += (normals[i] - n_mean).squaredNorm();
        }
        // A sliver says little of its ball's size.
        const double found_radius = found.balls[k].radius_px;
        const double radius = std::clamp(above / below, 0.85 * found_radius, 1.15 * found_radius);
        balls.push_back({(p_mean - radius * n_mean).cast<float>(), static_cast<float>(radius)});
    }
    return relief_of_balls(truth.photo.mask, balls);
}

/// All light that is known of the truth: near lamps, the grey surroundings, and the table at the
/// radiance that the photo shows; with the object's own shadows.
std::vector<Rgb> true_light(const TruthPhoto& truth, const Relief& relief,
                            const SurfacePoints& points, double eta) {
    ViewLights even;
    even.ambient = truth.ambient;
    even.from_below = truth.ground * kPi;
    std::vector<Rgb> result = entering_light(relief, points, even, eta, true);
    // The grey surroundings end where the table begins.
    const Occluder occluder(relief);
    const SkyShares sky = sky_shares(occluder, points);
    for (const NearLamp& lamp : truth.lamps) {
        const std::vector<float> seen = occluder.visibility(points, lamp.direction);
        for (std::size_t i = 0; i < result.size(); ++i) {
            const Vec3 way = lamp.position_px - points.position[i].cast<double>();
            const Vec3 w = way.normalized();
            const double falloff =
                std::pow(lamp.distance_px / way.norm(), 2) * std::max(0.0, w.dot(lamp.direction));
            const double e = entering_irradiance(points.normal[i], w, eta) * falloff * seen[i];
            result[i] += (lamp.irradiance * e).cast<float>();
        }
    }
    for (std::size_t i = 0; i < result.size(); ++i)
        result[i] -= truth.ambient.cast<float>() * sky.below[i];
    return result;
}

TruthPhoto read_truth(const fs::path& folder, const std::string& name) {
    TruthPhoto truth;
    truth.name = name;
    PhotoOptions options;
    options.mask = folder / (name + "_mask.png");
    truth.photo = read_photo(folder / (name + ".png"), options);
    const JsonObject json = read_json_file(folder / (name + ".json"));
    truth.px_per_m = json.object("camera").number("pixels_per_metre_at_object_centre");
    truth.exposure_scale = json.number("exposure_scale");
    truth.material = json.object("material").text("name");
    for (const JsonObject& light : json.objects("lights")) {
        const std::vector<double> d = light.numbers("direction_camera", 3);
        const std::vector<double> e = light.numbers("irradiance_facing", 3);
        truth.lights.lights.push_back(
            {Vec3(d[0], d[1], d[2]).normalized(), Rgbd(e[0], e[1], e[2])});
    }
    truth.lights.ambient = Rgbd::Constant(kPi * json.object("ambient").number("radiance"));
    std::stable_sort(truth.lights.lights.begin(), truth.lights.lights.end(),
                     [](const ViewLight& a, const ViewLight& b) {
                         return luminance(a.intensity) > luminance(b.intensity);
                     });
    const ExrImage depth = read_exr(folder / (name + "_depth.exr"));
    const ImageRgb normal = read_exr_rgb(folder / (name + "_normal.exr"));
    const ImageF& z = depth.channels.begin()->second;
    Relief& relief = truth.relief;
    relief.mask = truth.photo.mask;
    relief.inradius_px = inradius_px(relief.mask);
    relief.is_measured = true;
    relief.depth_px = ImageF(z.width(), z.height());
    relief.normals = Image<Vec3f>(z.width(), z.height(), Vec3f(0, 0, 1));
    truth.height_px = ImageF(z.width(), z.height());
    const double centre_m = json.object("object").numbers("centre_camera_m", 3)[2];
    for (std::size_t i = 0; i < z.size(); ++i)
        truth.height_px[i] = static_cast<float>((-z[i] - centre_m) * truth.px_per_m);
    for (std::size_t i = 0; i < z.size(); ++i) {
        if (relief.mask[i] <= 127) continue;
        relief.depth_px[i] = truth.height_px[i];
        const Vec3f n(normal[i][0], normal[i][1], normal[i][2]);
        if (n.norm() > 0.5f) relief.normals[i] = n.normalized();
    }
    // Nothing is known of the unseen back: as thick as the silhouette inflated, at most.
    ReliefOptions dome;
    dome.alpha = 0;
    relief =
        with_thickness(relief, thickness_of(shade_to_shape(truth.photo.linear, relief.mask, dome)));
    const JsonObject camera = json.object("camera");
    for (const JsonObject& light : json.objects("lights")) {
        NearLamp lamp;
        const std::vector<double> p = light.numbers("position_camera_m", 3);
        const std::vector<double> d = light.numbers("direction_camera", 3);
        const std::vector<double> e = light.numbers("irradiance_facing", 3);
        lamp.position_px =
            Vec3(camera.number("cx") + p[0] * truth.px_per_m,
                 -camera.number("cy") + p[1] * truth.px_per_m, (p[2] - centre_m) * truth.px_per_m);
        lamp.direction = Vec3(d[0], d[1], d[2]).normalized();
        lamp.irradiance = Rgbd(e[0], e[1], e[2]) / truth.exposure_scale;
        lamp.distance_px = light.number("distance_m") * truth.px_per_m;
        truth.lamps.push_back(lamp);
    }
    truth.ambient =
        Rgbd::Constant(kPi * json.object("ambient").number("radiance") / truth.exposure_scale);
    truth.ground = surroundings_below(truth.photo.linear, relief);
    if (fs::exists(folder / "profiles" / (truth.material + ".csv")))
        truth.profile_mm = read_profile_csv(folder / "profiles" / (truth.material + ".csv"));
    return truth;
}

void dump_encoded(const fs::path& path, const ImageRgb& linear, double scale = 1) {
    write_png(path, linear_to_srgb8(linear, static_cast<float>(scale)));
}

void dump_relief(const fs::path& path, const Relief& relief) {
    ImageRgb picture(relief.mask.width(), relief.mask.height());
    for (std::size_t i = 0; i < picture.size(); ++i)
        if (relief.mask[i] > 127) picture[i] = (0.5f * relief.normals[i].array() + 0.5f).pow(2.2f);
    dump_encoded(path, picture);
}

void dump_thickness(const fs::path& path, const Relief& relief) {
    ImageRgb picture(relief.mask.width(), relief.mask.height());
    const ImageF thickness = thickness_of(relief);
    for (std::size_t i = 0; i < picture.size(); ++i)
        picture[i] = Rgb::Constant(thickness[i] / static_cast<float>(2 * relief.inradius_px));
    dump_encoded(path, picture);
}

/// How far each true light is from the nearest estimated one; key = strongest front light.
void print_lights(const TruthPhoto& truth, const ViewLights& found, std::vector<double>& key,
                  std::vector<double>& fill) {
    std::string line;
    for (const ViewLight& light : truth.lights.lights) {
        double best = 180;
        for (const ViewLight& other : found.lights)
            best = std::min(best, degrees(angle_between(light.direction, other.direction)));
        const bool is_key = light.direction.z() > 0;
        (is_key ? key : fill).push_back(best);
        line += fmt::format(" {} {:.1f} deg", is_key ? "key" : "back", best);
    }
    fmt::print("  lights:{}   found:", line);
    const double total = found.total();
    for (const ViewLight& light : found.lights) {
        fmt::print(" ({:.2f} {:.2f} {:.2f}) {:.0f} %", light.direction.x(), light.direction.y(),
                   light.direction.z(), 100 * luminance(light.intensity) / total);
    }
    fmt::print(" ambient {:.0f} % ground {:.0f} %\n", 100 * luminance(found.ambient) / total,
               50 * luminance(found.from_below) / total);
}

void print_highlight_lights(const PhotoAnalysis& analysis, const TruthPhoto& truth) {
    fmt::print("  highlight lamps (votes: degrees to the nearest true lamp):");
    for (const HighlightLight& light : analysis.highlight_lights) {
        double best = 180;
        for (const ViewLight& other : truth.lights.lights)
            best = std::min(best, degrees(angle_between(light.direction, other.direction)));
        fmt::print(" {}: {:.0f} ({:.0f} %)", light.votes, best, 100 * luminance(light.intensity));
    }
    fmt::print("\n");
}

void print_profile(const TruthPhoto& truth, const MediumEstimate& medium, const char* label) {
    const RadialProfile found = medium.profile().scaled(1e3 / truth.px_per_m);  // in mm
    const Rgbd albedo = found.total(), true_albedo = truth.profile_mm.total();
    fmt::print("  {}: KS", label);
    for (int c = 0; c < 3; ++c)
        fmt::print(" {:.3f}", profile_ks_distance(found, truth.profile_mm, c, 0.5, 60));
    fmt::print("  albedo {:.2f} {:.2f} {:.2f} (true {:.2f} {:.2f} {:.2f})", albedo[0], albedo[1],
               albedo[2], true_albedo[0], true_albedo[1], true_albedo[2]);
    fmt::print("  ratio error R/G {:+.1f} % B/G {:+.1f} %",
               100 * (albedo[0] / albedo[1] / (true_albedo[0] / true_albedo[1]) - 1),
               100 * (albedo[2] / albedo[1] / (true_albedo[2] / true_albedo[1]) - 1));
    fmt::print("  mean r mm {:.1f} {:.1f} {:.1f} (true {:.1f} {:.1f} {:.1f})\n",
               medium.fit[0].mean_radius() * 1e3 / truth.px_per_m,
               medium.fit[1].mean_radius() * 1e3 / truth.px_per_m,
               medium.fit[2].mean_radius() * 1e3 / truth.px_per_m,
               truth.profile_mm.mean_radius()[0], truth.profile_mm.mean_radius()[1],
               truth.profile_mm.mean_radius()[2]);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        fmt::print(stderr,
                   "usage: vitrine_transfer_quality PHOTOS [--dump DIR] "
                   "[--lights lopez-moreno] [--solver qmr]\n");
        return 2;
    }
    const fs::path folder = argv[1];
    fs::path dump;
    TransferAnalysisOptions options;
    IrradianceSource irradiance = IrradianceSource::Photo;
    TransferLook look;
    for (int i = 2; i + 1 < argc; i += 2) {
        const std::string name = argv[i], value = argv[i + 1];
        if (name == "--dump") dump = value;
        if (name == "--lights" && value == "lopez-moreno")
            options.light_method = LightMethod::LopezMoreno;
        if (name == "--solver" && value == "qmr") options.bssrdf.solver = ProfileSolver::Qmr;
        if (name == "--highlights" && value == "phong")
            look.highlights = HighlightTransfer::Phong, look.phong_exponent = 5;
        if (name == "--irradiance" && value == "lights") irradiance = IrradianceSource::Lights;
        if (name == "--body" && value == "flat")
            options.bssrdf.use_curved_body = options.lights.use_curved_body = false;
        if (name == "--shape" && value == "inflated") options.shape = ShapeModel::Inflated;
        if (name == "--refine") options.refinement_rounds = std::atoi(value.c_str());
        if (name == "--coupling" && value == "free")
            options.bssrdf.coupling = ChannelCoupling::Free;
    }
    if (!dump.empty()) fs::create_directories(dump);

    TranslucentRenderOptions render_options;
    render_options.use_curved_body = options.bssrdf.use_curved_body;

    std::vector<double> key, fill;
    std::map<std::string, LiftedMaterial> lifted;
    std::map<std::string, TruthPhoto> truths;
    for (const std::string name : {"s1", "s3"}) {
        const TruthPhoto truth = read_truth(folder, name);
        const Timer timer;
        LiftedMaterial material = lift_material(truth.photo, options);
        fmt::print("{} ({}), {:.1f} s\n", name, truth.material, timer.seconds());
        fmt::print(
            "  highlights {:.1f} % of the object, {} blobs; normals {:.1f} deg mean, {} balls\n",
            100 * material.analysis.highlights.share, material.analysis.highlights.blobs.size(),
            mean_normal_error_deg(material.analysis.relief, truth.relief),
            material.analysis.relief.balls.size());
        print_highlight_lights(material.analysis, truth);
        print_lights(truth, material.analysis.lights.lights, key, fill);
        print_profile(truth, material.medium, "blind");
        fmt::print("  self PSNR {:.1f} dB (flat colour {:.1f} dB), light residual {:.2f}\n",
                   material.self_psnr_db, material.flat_psnr_db,
                   material.analysis.lights.relative_residual);
        const Relief true_relief = material.analysis.relief.is_cluster()
                                       ? true_cluster(truth, material.analysis.relief)
                                       : truth.relief;
        const EnteringLight light = [&](const Relief& lit, const SurfacePoints& points,
                                        double eta) { return true_light(truth, lit, points, eta); };
        BssrdfOptions exact = options.bssrdf;
        exact.is_level_known = exact.prefers_random_walk = true;
        const BodyEstimate known_body =
            estimate_body(true_relief, material.analysis.highlights.diffuse,
                          material.analysis.highlights.grown, light, exact);
        const MediumEstimate& known = known_body.medium;
        fmt::print("  {}, residuals {:.3f} {:.3f} {:.3f}\n",
                   known.is_fresnel ? "Fresnel" : "no Fresnel", known.channels[0].relative_residual,
                   known.channels[1].relative_residual, known.channels[2].relative_residual);
        print_profile(truth, known, "true shape and lights");
        for (const std::string& warning : material.analysis.warnings)
            fmt::print("  ! {}\n", warning);
        for (const std::string& warning : material.medium.warnings) fmt::print("  ! {}\n", warning);
        if (!dump.empty()) {
            dump_encoded(dump / (name + "_diffuse.png"), material.analysis.highlights.diffuse);
            write_png(dump / (name + "_grown.png"), material.analysis.highlights.grown);
            dump_encoded(dump / (name + "_self.png"), material.rendered);
            dump_relief(dump / (name + "_relief.png"), material.analysis.relief);
            dump_relief(dump / (name + "_true_relief.png"), truth.relief);
            dump_thickness(dump / (name + "_thickness.png"), material.analysis.relief);
            dump_thickness(dump / (name + "_thickness_known.png"), known_body.relief);
        }
        lifted.emplace(name, std::move(material));
        truths.emplace(name, truth);
    }
    std::vector<double> psnrs;
    int better = 0;
    for (const std::string name : {"t1", "t2"}) {
        const TruthPhoto truth = read_truth(folder, name);
        const Timer timer;
        const PhotoAnalysis object = analyse_object(truth.photo, options);
        fmt::print(
            "{}, {:.1f} s\n  highlights {:.1f} % of the object, {} blobs; normals {:.1f} deg "
            "mean\n",
            name, timer.seconds(), 100 * object.highlights.share, object.highlights.blobs.size(),
            mean_normal_error_deg(object.relief, truth.relief));
        print_highlight_lights(object, truth);
        print_lights(truth, object.lights.lights, key, fill);
        if (!dump.empty()) {
            dump_encoded(dump / (name + "_diffuse.png"), object.highlights.diffuse);
            write_png(dump / (name + "_grown.png"), object.highlights.grown);
            dump_relief(dump / (name + "_relief.png"), object.relief);
            dump_relief(dump / (name + "_true_relief.png"), truth.relief);
        }
        const TransferSession session(object, irradiance, render_options);
        {
            const RadialProfile profile = lifted.at("s1").medium.profile();
            const Timer look_timer;
            TransferLook brighter = look;
            brighter.exposure = 1.1;
            session.render(profile, brighter);
            const double look_s = look_timer.seconds();
            TransferSession relit(object, irradiance, render_options);
            const Timer light_timer;
            relit.set_lights(object.lights.lights);
            relit.render(profile, brighter);
            fmt::print(
                "  change of look {:.2f} s (bar 0.15 at 1 Mpx), of light {:.2f} s (bar 0.3)\n",
                look_s, light_timer.seconds());
        }
        for (const std::string source : {"s1", "s3"}) {
            const LiftedMaterial& material = lifted.at(source);
            const double ratio = length_ratio(1, 1, truths.at(source).px_per_m, truth.px_per_m);
            const TransferPicture result =
                session.render(material.medium.profile().scaled(ratio), look);
            const std::string id = source + "_" + name;
            const ImageRgb exact = read_linear_rgb(folder / (id + ".png"));
            const ObjectScore ours = score_object(result.picture, exact, truth.photo.mask);
            const Rgbd albedo(material.medium.channels[0].albedo,
                              material.medium.channels[1].albedo,
                              material.medium.channels[2].albedo);
            ImageRgb flat = lambertian_recolouring(
                object.relief, irradiance_from_lights(object.relief, object.lights.lights, 1.3),
                albedo);
            for (std::size_t i = 0; i < flat.size(); ++i)
                flat[i] = flat[i] * static_cast<float>(0.7) + object.highlights.residual[i];
            const ObjectScore lambert = score_object(flat, exact, truth.photo.mask);
            const RadialProfile true_profile =
                truths.at(source).profile_mm.scaled(truth.px_per_m / 1e3);
            const ObjectScore oracle =
                score_object(session.render(true_profile, {}).picture, exact, truth.photo.mask);
            const HighlightScore spot = score_highlight(result.picture, exact, truth.photo.mask);
            fmt::print(
                "  {}: PSNR {:.1f} dB (linear {:.1f})  SSIM {:.3f}  Lambert {:.1f} dB ({:+.1f})  "
                "true R_d {:.1f} dB  highlight off by {:.2f} px, dE {:.1f}\n",
                id, ours.psnr_db, ours.linear_psnr_db, ours.ssim, lambert.psnr_db,
                ours.psnr_db - lambert.psnr_db, oracle.psnr_db, spot.centroid_px, spot.delta_e);
            psnrs.push_back(ours.psnr_db);
            if (ours.psnr_db - lambert.psnr_db >= 3) ++better;
            if (!dump.empty()) {
                dump_encoded(dump / (id + ".png"), result.picture);
                dump_encoded(dump / (id + "_lambert.png"), flat);
            }
        }
    }
    fmt::print("key light {:.1f} deg median (bar 6), back light {:.1f} deg median (bar 15)\n",
               median(key), median(fill));
    fmt::print(
        "transfer PSNR {:.1f} dB mean (bar 26), {:.1f} dB lowest (bar 24), {} of 4 at least "
        "3 dB above Lambert (bar 3)\n",
        mean(psnrs), *std::min_element(psnrs.begin(), psnrs.end()), better);
    return 0;
}
