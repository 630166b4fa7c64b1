#include "estimate/scene_estimate.h"

#include "base/log.h"
#include "base/timer.h"

namespace vitrine {

namespace {

std::vector<ObjectClass> classes_of(const std::vector<ObjectEstimate>& objects) {
    std::vector<ObjectClass> classes;
    for (const ObjectEstimate& object : objects) classes.push_back(object.object_class);
    return classes;
}

void force_diffuse(std::vector<ObjectEstimate>& objects) {
    for (ObjectEstimate& object : objects) {
        object.object_class = ObjectClass::Diffuse;
        object.reason = "forced to diffuse";
    }
}

/// The light cost, and the fitted cost of every object, as one figure.
double total_error(const LightEstimate& light, const std::vector<ObjectEstimate>& objects) {
    double sum = light.error_refined;
    for (const ObjectEstimate& o : objects)
        sum += o.object_class == ObjectClass::Specular      ? o.cost_ward
               : o.object_class == ObjectClass::Transparent ? std::min(o.cost_solid, o.cost_shell)
                                                            : o.cost_diffuse;
    return sum / (1.0 + static_cast<double>(objects.size()));
}

}  // namespace

bool SceneEstimate::is_complete() const {
    if (light.outcome != Outcome::Converged) return false;
    for (const ObjectEstimate& object : objects) {
        switch (object.object_class) {
            case ObjectClass::Unsure:
                return false;
            case ObjectClass::Transparent:
                if (object.ior.outcome != Outcome::Converged ||
                    object.sigma_a_per_m.outcome != Outcome::Converged)
                    return false;
                break;
            case ObjectClass::Specular:
                for (const WardCluster& cluster : object.clusters)
                    if (cluster.fit.sigma.outcome != Outcome::Converged) return false;
                break;
            case ObjectClass::Diffuse:
                break;
        }
    }
    return true;
}

SceneEstimate estimate_scene(const Scene& scene, const Capture& capture,
                             const EstimateOptions& options, const Progress& progress) {
    if (options.method != EstimateMethod::Default) {
        SceneEstimate published = estimate_published(scene, capture, options, progress);
        if (options.lambertian) force_diffuse(published.objects);
        return published;
    }
    SceneEstimate result;
    Timer timer;
    result.light = options.first_light
                       ? *options.first_light
                       : estimate_first_light(scene, capture, options, progress.part(0.0, 0.4));
    result.seconds.emplace_back("light", timer.seconds());
    if (result.light.lights.empty()) return result;

    timer = Timer();
    result.objects =
        estimate_materials(scene, capture.frames, capture.saturation_level, result.light,
                           options.overrides.objects, options.materials, progress.part(0.4, 0.7));
    result.seconds.emplace_back("materials", timer.seconds());
    result.error_initial = total_error(result.light, result.objects);
    result.error_joint = result.error_initial;

    if (options.refine_jointly && !result.objects.empty()) {
        timer = Timer();
        LightOptions again = first_light_options(capture, options);
        again.object_classes = classes_of(result.objects);
        const std::string rival = result.light.rival;  // refining looks at no other place
        std::vector<DiscLight> start;
        for (const FittedLight& fitted : result.light.lights) start.push_back(fitted.light);
        again.start = start;
        LightEstimate refined = estimate_lights(scene, capture.frames, capture.saturation_level,
                                                again, progress.part(0.7, 0.85));
        refined.error_initial = result.light.error_initial;
        refined.grid_direction = result.light.grid_direction;
        result.light =
            refine_light_jointly(scene, capture.frames, capture.saturation_level, refined, again,
                                 options.materials, options.joint, result.objects, &result.joint);
        doubt_by_rival(result.light, rival);
        refit_specular(scene, capture.frames, capture.saturation_level, result.light,
                       options.materials, result.objects, progress.part(0.85, 1.0));
        result.error_joint = total_error(result.light, result.objects);
        result.seconds.emplace_back("joint", timer.seconds());
    }
    if (options.lambertian) force_diffuse(result.objects);
    progress.update(1.0);
    return result;
}

}  // namespace vitrine
