// The published methods behind `--method`, up to a SceneEstimate like any other.
#include "base/error.h"
#include "base/timer.h"
#include "estimate/object_context.h"
#include "estimate/scene_estimate.h"
#include "math/statistics.h"

#include <algorithm>
#include <array>

namespace vitrine {

namespace {

constexpr std::array<std::pair<EstimateMethod, const char*>, 4> kMethods = {
    {{EstimateMethod::Default, "default"},
     {EstimateMethod::Paper, "paper"},
     {EstimateMethod::Local, "local"},
     {EstimateMethod::InversePhoton, "inverse-photon"}}};

/// A candidate in a world that is Lambertian by assumption: median of radiance over irradiance.
ObjectEstimate lambertian_object(const Scene& scene, const ObjectContext& context, int k,
                                 const ObjectPixelOptions& pixel_options) {
    constexpr float kMinLit = 0.05f;  // per W/sr and m2: fainter is shadow
    const Part& part = scene.parts[static_cast<std::size_t>(context.world.part_of_object(k))];
    ObjectEstimate object;
    object.id = part.name;
    object.mesh_file = part.mesh_file;
    object.object_class = ObjectClass::Diffuse;
    object.reason = "this method takes the whole world as diffuse";
    std::vector<SurfacePoint> points;
    std::vector<Rgb> radiance;
    for (const ObjectPixel& pixel : object_pixels(context.world, context.lookup, k, pixel_options))
        if (!pixel.is_clipped) {
            points.push_back(pixel.surface);
            radiance.push_back(pixel.radiance);
        }
    std::vector<Rgb> irradiance(points.size(), Rgb::Zero());
    for (const DiscLight& lamp : context.light.lights) {
        const DirectColumn lit =
            direct_column(context.world, points, {lamp.position_m, lamp.normal, lamp.radius_m}, 4,
                          kScanMask | object_mask(k), 0);
        for (std::size_t i = 0; i < points.size(); ++i)
            if (lit.clear[i] > kMinLit) irradiance[i] += lit.clear[i] * lamp.intensity_w_per_sr;
    }
    for (int c = 0; c < 3; ++c) {
        std::vector<double> ratio;
        for (std::size_t i = 0; i < points.size(); ++i)
            if (irradiance[i][c] > 0.0f) ratio.push_back(kPif * radiance[i][c] / irradiance[i][c]);
        if (!ratio.empty())
            object.albedo[c] = static_cast<float>(std::clamp(median(ratio), 0.0, 1.0));
    }
    return object;
}

}  // namespace

std::string method_name(EstimateMethod method) {
    for (const auto& [value, name] : kMethods)
        if (value == method) return name;
    throw InternalError("a method without a name");
}

EstimateMethod method_from_name(const std::string& name) {
    for (const auto& [value, word] : kMethods)
        if (name == word) return value;
    throw InternalError("no such method: " + name);
}

LightOptions first_light_options(const Capture& capture, const EstimateOptions& options) {
    LightOptions light = options.lights;
    light.seed = options.seed;
    if (!light.reference_albedo) light.reference_albedo = capture.reference_albedo;
    if (!options.overrides.lights.empty()) light.known_lights = options.overrides.lights;
    return light;
}

LightEstimate estimate_first_light(const Scene& scene, const Capture& capture,
                                   const EstimateOptions& options, const Progress& progress) {
    const LightOptions light = first_light_options(capture, options);
    if (options.method == EstimateMethod::Default || !light.known_lights.empty())
        return estimate_lights(scene, capture.frames, capture.saturation_level, light, progress);
    GridLightOptions grid = options.paper.lights;
    grid.model =
        options.method == EstimateMethod::Local ? GridLightModel::Local : GridLightModel::Photons;
    return estimate_grid_lights(scene, capture.frames, capture.saturation_level, light, grid,
                                progress)
        .light;
}

SceneEstimate estimate_published(const Scene& scene, const Capture& capture,
                                 const EstimateOptions& options, const Progress& progress) {
    SceneEstimate result;
    result.method = options.method;
    Timer timer;
    result.light = options.first_light
                       ? *options.first_light
                       : estimate_first_light(scene, capture, options, progress.part(0.0, 0.5));
    result.seconds.emplace_back("light", timer.seconds());
    result.error_initial = result.error_joint = result.light.error_refined;
    if (result.light.lights.empty()) return result;
    if (options.method == EstimateMethod::Paper) {
        PaperEstimate paper =
            estimate_paper(scene, capture.frames, capture.saturation_level, result.light,
                           options.overrides.objects, options.materials.pixels, options.paper,
                           progress.part(0.5, 1.0));
        result.objects = std::move(paper.objects);
        result.seconds.insert(result.seconds.end(), paper.seconds.begin(), paper.seconds.end());
        if (!result.objects.empty()) {
            result.error_initial = paper.error_initial;
            result.error_joint = paper.error_joint;
        }
        return result;
    }
    timer = Timer();
    const ObjectContext context(scene, capture.frames, capture.saturation_level, result.light);
    for (int k = 0; k < context.world.object_count(); ++k)
        result.objects.push_back(lambertian_object(scene, context, k, options.materials.pixels));
    result.seconds.emplace_back("materials", timer.seconds());
    return result;
}

}  // namespace vitrine
