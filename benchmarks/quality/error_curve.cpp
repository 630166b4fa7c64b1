// Photometric error over the error of the light (the paper's Fig. 13), by kind of cue:
//   vitrine_error_curve [--scan CACHE] [--azimuths N] CAPTURE...
// The first true lamp is turned about the middle of the scene by each angle, toward N sides;
// strength, ambient light, Ward lobes and refractive index are fitted again at each place. Mean
// over the sides. Without --scan the true meshes are used.
#include "estimate/caustic_cue.h"
#include "estimate/object_context.h"
#include "estimate/scene_estimate.h"
#include "math/sampling.h"
#include "truth_scene.h"

#include <algorithm>
#include <array>
#include <cstdio>

using namespace vitrine;

namespace {

constexpr std::array<double, 6> kAngles = {0.0, 1.0, 2.0, 4.0, 8.0, 16.0};  // degrees
constexpr int kIndices = 17;                                                // in [1.2, 2]

std::vector<DiscLight> with_first_turned(std::vector<DiscLight> lights, const Vec3& about,
                                         double angle_rad, double side_rad) {
    const Vec3 offset = lights[0].position_m - about;
    const Frame frame(offset.normalized().cast<float>());
    const Vec3 direction =
        (offset.normalized() +
         std::tan(angle_rad) * (std::cos(side_rad) * frame.tangent.cast<double>() +
                                std::sin(side_rad) * frame.bitangent.cast<double>()))
            .normalized();
    lights[0].position_m = about + offset.norm() * direction;
    lights[0].normal = -direction;
    return lights;
}

/// Robust cost of the caustic and shadow of one glass, the best index taken.
double caustic_cost(const ObjectContext& context, int k, const LightEstimate& light,
                    const Rgb& sigma_a_per_m) {
    std::vector<double> iors;
    for (int i = 0; i < kIndices; ++i) iors.push_back(1.2 + 0.8 * i / (kIndices - 1.0));
    CausticScene scene;
    scene.lights = context.light.lights;
    scene.ambient = light.ambient_radiance;
    scene.sigma_a_per_m = sigma_a_per_m;
    scene.plane = light.plane;
    const std::vector<double> cost =
        caustic_cue(context.world, context.lookup, k, scene, iors).cost;
    return cost.empty() ? 1.0 : *std::min_element(cost.begin(), cost.end());
}

void print_curve(const std::string& name, const Scene& scene, const Capture& capture,
                 const TrueScene& truth, int azimuths) {
    const SceneEstimate ours = estimate_scene(scene, capture);
    LightOptions options = first_light_options(capture, {});
    for (const ObjectEstimate& object : ours.objects)
        options.object_classes.push_back(object.object_class);
    options.keep_start = true;
    std::printf("\n%s\n| degrees off | shading and shadows |", name.c_str());
    for (const ObjectEstimate& object : ours.objects)
        std::printf(" %s, %s |", object.id.c_str(), class_name(object.object_class).c_str());
    std::printf("\n");
    for (const double angle : kAngles) {
        const int sides = angle == 0.0 ? 1 : azimuths;
        std::vector<double> sum(1 + ours.objects.size(), 0.0);
        for (int side = 0; side < sides; ++side) {
            options.start = with_first_turned(truth.lights, truth.reference_point_m, radians(angle),
                                              2.0 * kPi * side / sides);
            const LightEstimate light =
                estimate_lights(scene, capture.frames, capture.saturation_level, options);
            sum[0] += light.error_refined / sides;
            const ObjectContext context(scene, capture.frames, capture.saturation_level, light);
            for (std::size_t k = 0; k < ours.objects.size(); ++k) {
                const ObjectEstimate& object = ours.objects[k];
                const int index = static_cast<int>(k);
                double cost = object.cost_diffuse;
                if (object.object_class == ObjectClass::Transparent)
                    cost = caustic_cost(context, index, light, object.sigma_a_per_m.value);
                if (object.object_class == ObjectClass::Specular)
                    cost = fit_ward_clusters(context.world,
                                             object_pixels(context.world, context.lookup, index),
                                             context.light_on(index), context.bright, {})
                               .cost;
                sum[1 + k] += cost / sides;
            }
        }
        std::printf("| %.0f |", angle);
        for (const double cost : sum) std::printf(" %.4f |", cost);
        std::printf("\n");
        std::fflush(stdout);
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::filesystem::path cache;
    int azimuths = 4;
    std::vector<std::filesystem::path> folders;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--scan" && i + 1 < argc) {
            cache = argv[++i];
        } else if (word == "--azimuths" && i + 1 < argc) {
            azimuths = std::max(1, std::atoi(argv[++i]));
        } else {
            folders.emplace_back(word);
        }
    }
    for (const std::filesystem::path& folder : folders) {
        const Capture capture = read_capture(folder);
        const Scene scene = cache.empty() ? make_true_geometry(folder, capture)
                                          : cached_reconstruction(capture, cache);
        print_curve(capture.name, scene, capture, read_truth(folder), azimuths);
    }
}
