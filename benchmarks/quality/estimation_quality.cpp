// Errors of the estimators against known truth:
//   vitrine_estimation_quality [--scan CACHE] [--pictures DIR] [--verbose] CAPTURE...
// Without --scan the true meshes take the place of a reconstruction: what is left is the
// estimators' own error. Ends with every bar as value, bar, pass.
#include "base/log.h"
#include "base/timer.h"
#include "estimate/scene_estimate.h"
#include "estimation_bars.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "truth_scene.h"

#include <cstdio>
#include <ctime>

using namespace vitrine;

namespace {

constexpr double kMaxSeconds = 45.0;  // on two cores with nothing else to do

void print_lights(const TrueScene& truth, const LightEstimate& estimate) {
    std::printf(
        "lights: cost %.4f -> %.4f  rms %.3f  ambient %.4f (true %.4f)  ref %.3f %.3f "
        "%.3f\n",
        estimate.error_initial, estimate.error_refined, estimate.residual_rms,
        estimate.ambient_radiance[1], truth.ambient_radiance[1], estimate.reference_point_m.x(),
        estimate.reference_point_m.y(), estimate.reference_point_m.z());
    std::printf("  best of the 36 grid lights: direction error %.2f deg\n",
                grid_error_deg(truth, estimate));
    std::printf("  %zu lights found, %zu true\n", estimate.lights.size(), truth.lights.size());
    for (const DiscLight& light : truth.lights) {
        const FittedLight* nearest = nearest_found(truth, light, estimate);
        if (!nearest) continue;
        const FittedLight& fitted = *nearest;
        const Vec3 d = fitted.light.position_m - truth.reference_point_m;
        const Vec3 t = light.position_m - truth.reference_point_m;
        std::printf(
            "  light: direction error %.2f deg (sd %.2f), elevation error %.2f, distance %.3f "
            "(true %.3f, %+.1f %%, sd %.3f), radius %.3f (%.3f), intensity ratio %.3f %.3f %.3f\n",
            light_error_deg(truth, light, estimate), fitted.stddev_direction_deg,
            std::abs(degrees(std::asin(d.normalized().z()) - std::asin(t.normalized().z()))),
            d.norm(), t.norm(), 100 * (d.norm() / t.norm() - 1), fitted.stddev_distance_m,
            fitted.light.radius_m, light.radius_m,
            fitted.light.intensity_w_per_sr[0] / light.intensity_w_per_sr[0],
            fitted.light.intensity_w_per_sr[1] / light.intensity_w_per_sr[1],
            fitted.light.intensity_w_per_sr[2] / light.intensity_w_per_sr[2]);
    }
}

void print_object(const TrueObject& truth, const ObjectEstimate& object) {
    std::printf(
        "  %s %s%s: class %s%s, margin %+.2f (solid %.4f shell %.4f ward %.4f diffuse %.4f)\n",
        truth.name.c_str(), truth.is_hollow ? "hollow " : "", truth.object_class.c_str(),
        object.is_hollow ? "hollow " : "", class_name(object.object_class).c_str(),
        object.class_margin, object.cost_solid, object.cost_shell, object.cost_ward,
        object.cost_diffuse);
    if (object.object_class == ObjectClass::Transparent) {
        const Rgb& s = object.sigma_a_per_m.value;
        const Rgb& sd = object.sigma_a_per_m.stddev;
        std::printf(
            "    ior %.4f +- %.4f (true %.3f, %s), sigma_a %.2f %.2f %.2f +- %.2f %.2f %.2f (true "
            "%.1f %.1f %.1f)\n",
            object.ior.value, object.ior.stddev, truth.ior,
            outcome_name(object.ior.outcome).c_str(), s[0], s[1], s[2], sd[0], sd[1], sd[2],
            truth.sigma_a_per_m[0], truth.sigma_a_per_m[1], truth.sigma_a_per_m[2]);
    }
    if (object.object_class == ObjectClass::Specular)
        for (const WardCluster& cluster : object.clusters) {
            const Ward& w = cluster.fit.ward;
            std::printf(
                "    sigma %.4f +- %.4f (true %.3f), rho_d %.3f %.3f %.3f (%.2f %.2f %.2f), rho_s "
                "%.3f %.3f %.3f (%.2f %.2f %.2f), form %s\n",
                w.sigma_x, cluster.fit.sigma.stddev, truth.sigma, w.rho_d[0], w.rho_d[1],
                w.rho_d[2], truth.rho_d[0], truth.rho_d[1], truth.rho_d[2], w.rho_s[0], w.rho_s[1],
                w.rho_s[2], truth.rho_s[0], truth.rho_s[1], truth.rho_s[2],
                w.form == WardForm::Duer ? "duer" : "ward");
        }
}

/// What the cameras would see of the applied scene's albedo: shadows left in it show here.
void write_albedo_picture(const Scene& applied, std::size_t frame, const std::string& path) {
    const EstimationScene world(applied);
    const Camera& camera = applied.cameras[frame];
    const Vec3f eye = camera.centre_in_world().cast<float>();
    ImageRgb picture(camera.width, camera.height);
    for (int v = 0; v < camera.height; ++v)
        for (int u = 0; u < camera.width; ++u) {
            const Vec3f direction = camera.ray_in_world(u, v).cast<float>();
            const Hit hit = world.accel().closest({eye, direction, 0.0f, 1e30f, kScanMask});
            if (const auto colour = world.scan_radiance(hit, direction)) picture(u, v) = *colour;
        }
    write_png(path, linear_to_srgb8(picture));
}

}  // namespace

int main(int argc, char** argv) {
    std::filesystem::path cache, pictures;
    std::vector<Bar> bars;
    std::vector<double> light_errors, grid_errors;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument == "--scan" && i + 1 < argc) {
            cache = argv[++i];
            continue;
        }
        if (argument == "--pictures" && i + 1 < argc) {
            pictures = argv[++i];
            continue;
        }
        if (argument == "--verbose") {
            set_log_level(LogLevel::Debug);
            continue;
        }
        const std::filesystem::path folder = argument;
        std::printf("== %s, %s geometry\n", folder.filename().c_str(),
                    cache.empty() ? "true" : "reconstructed");
        const Capture capture = read_capture(folder);
        const TrueScene truth = read_truth(folder);
        const Scene scene = cache.empty() ? make_true_geometry(folder, capture)
                                          : cached_reconstruction(capture, cache);
        Timer timer;
        const std::clock_t start = std::clock();
        const SceneEstimate estimate = estimate_scene(scene, capture);
        const double cpu = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        const double wall_seconds = timer.seconds();
        std::printf("estimation %.1f s (CPU %.1f s):", wall_seconds, cpu);
        for (const auto& [part, seconds] : estimate.seconds)
            std::printf(" %s %.1f", part.c_str(), seconds);
        std::printf(", error %.4f -> %.4f, complete: %s\n", estimate.error_initial,
                    estimate.error_joint, estimate.is_complete() ? "yes" : "no");
        print_lights(truth, estimate.light);
        const EstimationScene world(scene);
        for (int k = 0; k < world.object_count(); ++k) {
            const ObjectEstimate& object = estimate.objects[static_cast<std::size_t>(k)];
            const TrueObject* match = object_at(truth, world.mesh(world.part_of_object(k)));
            TrueObject nothing;
            nothing.name = "nothing there";
            nothing.object_class = "diffuse";
            print_object(match ? *match : nothing, object);
        }
        const GeometrySource source =
            cache.empty() ? GeometrySource::True : GeometrySource::Reconstructed;
        add_light_bars(capture.name, truth, estimate.light, bars);
        add_object_bars(capture.name, truth, scene, capture, estimate, source, bars);
        bars.push_back({capture.name, "seconds of estimation", wall_seconds, kMaxSeconds, ""});
        if (truth.lights.size() == 1 && !truth.objects.empty()) {
            light_errors.push_back(light_error_deg(truth, truth.lights[0], estimate.light));
            grid_errors.push_back(grid_error_deg(truth, estimate.light));
        }
        if (pictures.empty()) continue;
        timer = Timer();
        const Scene applied = apply(scene, estimate);
        std::printf("apply %.1f s\n", timer.seconds());
        std::filesystem::create_directories(pictures);
        for (const std::size_t frame : {0, 3})
            write_albedo_picture(
                applied, frame,
                (pictures / (capture.name + "_albedo_" + capture.frames[frame].id + ".png"))
                    .string());
    }
    add_mean_bars(light_errors, grid_errors, bars);
    print_bars(bars);
}
