// Errors of the estimators against known truth: vitrine_estimation_quality CAPTURE...
// Uses the true meshes in place of a reconstruction: what is left is the estimators' own error.
#include "base/log.h"
#include "base/timer.h"
#include "estimate/materials.h"
#include "truth_scene.h"

#include <cstdio>

using namespace vitrine;

namespace {

void print_lights(const TrueScene& truth, const LightEstimate& estimate, double seconds) {
    std::printf(
        "lights %.1f s  cost %.4f -> %.4f  rms %.3f  ambient %.4f (true %.4f)  ref %.3f %.3f "
        "%.3f\n",
        seconds, estimate.error_initial, estimate.error_refined, estimate.residual_rms,
        estimate.ambient_radiance[1], truth.ambient_radiance[1], estimate.reference_point_m.x(),
        estimate.reference_point_m.y(), estimate.reference_point_m.z());
    for (const FittedLight& fitted : estimate.lights) {
        const DiscLight* nearest = nullptr;
        double error = 1e30;
        for (const DiscLight& light : truth.lights) {
            const double e = angle_between(light.position_m - truth.reference_point_m,
                                           fitted.light.position_m - truth.reference_point_m);
            if (e < error) error = e, nearest = &light;
        }
        const Vec3 d = fitted.light.position_m - truth.reference_point_m;
        const Vec3 t = nearest->position_m - truth.reference_point_m;
        std::printf(
            "  light: direction error %.2f deg (sd %.2f), elevation error %.2f, distance %.3f "
            "(true %.3f, %+.1f %%, sd %.3f), radius %.3f (%.3f), intensity ratio %.3f %.3f %.3f\n",
            degrees(error), fitted.stddev_direction_deg,
            std::abs(degrees(std::asin(d.normalized().z()) - std::asin(t.normalized().z()))),
            d.norm(), t.norm(), 100 * (d.norm() / t.norm() - 1), fitted.stddev_distance_m,
            fitted.light.radius_m, nearest->radius_m,
            fitted.light.intensity_w_per_sr[0] / nearest->intensity_w_per_sr[0],
            fitted.light.intensity_w_per_sr[1] / nearest->intensity_w_per_sr[1],
            fitted.light.intensity_w_per_sr[2] / nearest->intensity_w_per_sr[2]);
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

}  // namespace

int main(int argc, char** argv) {
    set_log_level(LogLevel::Debug);
    for (int i = 1; i < argc; ++i) {
        const std::filesystem::path folder = argv[i];
        std::printf("== %s\n", folder.filename().c_str());
        const Capture capture = read_capture(folder);
        const TrueScene truth = read_truth(folder);
        Timer timer;
        const Scene scene = make_true_geometry(folder, capture);
        std::printf("geometry %.1f s\n", timer.seconds());
        LightOptions options;
        options.reference_albedo = capture.reference_albedo;
        timer = Timer();
        const LightEstimate lights =
            estimate_lights(scene, capture.frames, capture.saturation_level, options);
        print_lights(truth, lights, timer.seconds());
        timer = Timer();
        const std::vector<ObjectEstimate> objects =
            estimate_materials(scene, capture.frames, capture.saturation_level, lights);
        std::printf("materials %.1f s\n", timer.seconds());
        for (std::size_t k = 0; k < objects.size(); ++k) print_object(truth.objects[k], objects[k]);
    }
}
