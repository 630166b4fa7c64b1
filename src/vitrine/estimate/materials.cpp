#include "estimate/materials.h"

#include "base/log.h"
#include "estimate/caustic_cue.h"
#include "estimate/object_context.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

// A lobe must improve a diffuse fit by this much (in the logarithm) to be believed.
constexpr double kLobeGain = 0.15;
// A clear coat of index 1.5 reflects 4 %: a lobe no stronger is gloss on paint or plastic.
constexpr double kCoatReflectance = 0.06;
constexpr int kMinPixels = 60;

double log_ratio(double a, double b) { return std::log(std::max(a, 1e-4) / std::max(b, 1e-4)); }

double strongest_lobe(const std::vector<WardCluster>& clusters) {
    double strongest = 0.0;
    for (const WardCluster& cluster : clusters)
        strongest = std::max(strongest, double{luminance(cluster.fit.ward.rho_s)});
    return strongest;
}

/// Class by cost; fills margin and reason.
ObjectClass classify(ObjectEstimate& object, double lobe_gain, double unsure_margin) {
    const double clear = std::min(object.cost_solid, object.cost_shell);
    object.class_margin = log_ratio(object.cost_ward, clear);
    if (std::abs(object.class_margin) < unsure_margin) {
        object.reason = "glass and metal explain its pictures about equally well";
        return ObjectClass::Unsure;
    }
    if (object.class_margin > 0.0) return ObjectClass::Transparent;
    if (lobe_gain < kLobeGain) return ObjectClass::Diffuse;
    if (strongest_lobe(object.clusters) < kCoatReflectance) {
        object.reason = "its gloss is as faint as that of plastic or paint";
        return ObjectClass::Diffuse;
    }
    return ObjectClass::Specular;
}

/// The index of solid glass with its caustic as a second cue.
Estimate<double> with_caustic(const EstimationScene& world, const FrameLookup& lookup, int object,
                              const LightEstimate& lights, const TransparentFit& solid,
                              const TransparentOptions& options) {
    constexpr int kTrials = 21;
    std::vector<double> iors;
    for (int k = 0; k < kTrials; ++k)
        iors.push_back(options.ior_min + (options.ior_max - options.ior_min) * k / (kTrials - 1.0));
    CausticScene light;
    for (const FittedLight& fitted : lights.lights) light.lights.push_back(fitted.light);
    light.ambient = lights.ambient_radiance;
    light.sigma_a_per_m = solid.sigma_a_per_m.value;
    light.plane = lights.plane;
    const CausticCue cue = caustic_cue(world, lookup, object, light, iors);
    const Estimate<double> index = combined_index(solid.ior, iors, cue);
    log_debug("caustic: {} places, spread {:.3f}, index {:.4f} -> {:.4f}", cue.receiver_count,
              cue.stddev, solid.ior.value, index.value);
    return index;
}

bool has_two_views(const std::vector<ObjectPixel>& pixels) {
    return std::any_of(pixels.begin(), pixels.end(), [&](const ObjectPixel& pixel) {
        return pixel.frame != pixels.front().frame;
    });
}

/// One view: what lies behind glass and where a highlight moves would both be guesses.
void doubt_all(ObjectEstimate& object, const ObjectOverride* known) {
    const auto doubt = [](auto& quantity) {
        quantity.outcome = Outcome::NotIdentifiable;
        quantity.reason = "only one view shows this object: no second picture checks it";
    };
    if (!known || !known->ior) doubt(object.ior);
    if (!known || !known->sigma_a_per_m) doubt(object.sigma_a_per_m);
    doubt(object.wall_m);
    for (WardCluster& cluster : object.clusters) doubt(cluster.fit.sigma);
}

}  // namespace

const ObjectOverride* find_override(const std::vector<ObjectOverride>& overrides,
                                    const std::string& id) {
    for (const ObjectOverride& o : overrides)
        if (o.id == id) return &o;
    return nullptr;
}

std::vector<ObjectEstimate> estimate_materials(const Scene& scene,
                                               std::span<const RgbdFrame> frames,
                                               double saturation_level, const LightEstimate& lights,
                                               const std::vector<ObjectOverride>& overrides,
                                               const MaterialOptions& options,
                                               const Progress& progress) {
    std::vector<ObjectEstimate> objects;
    const ObjectContext context(scene, frames, saturation_level, lights);
    const EstimationScene& world = context.world;
    const FrameLookup& lookup = context.lookup;
    const double bright = context.bright;

    for (int k = 0; k < world.object_count(); ++k) {
        progress.update(static_cast<double>(k) / world.object_count(), "materials");
        ObjectEstimate object;
        const Part& part = scene.parts[static_cast<std::size_t>(world.part_of_object(k))];
        object.id = part.name;
        object.mesh_file = part.mesh_file;
        const ObjectOverride* override = find_override(overrides, object.id);
        const std::vector<ObjectPixel> pixels = object_pixels(world, lookup, k, options.pixels);
        if (static_cast<int>(pixels.size()) < kMinPixels) {
            object.reason = "too few pixels show this object";
            objects.push_back(object);
            continue;
        }
        TransparentOptions transparent = options.transparent;
        transparent.ambient = lights.ambient_radiance;
        if (override) {
            transparent.known_ior = override->ior;
            transparent.known_sigma_a = override->sigma_a_per_m;
        }
        const TransparentFit solid = fit_solid(world, lookup, k, pixels, bright, transparent);
        const TransparentFit shell = fit_shell(world, lookup, k, pixels, bright, transparent);
        const ClusteredWard metal =
            fit_ward_clusters(world, pixels, context.light_on(k), bright, options.specular);
        const WardFit& ward = metal.whole;
        object.cost_solid = solid.cost;
        object.cost_shell = shell.cost;
        object.cost_ward = metal.cost;
        object.cost_diffuse = metal.cost_diffuse;
        object.clusters = metal.clusters;
        object.class_margin = 0.0;
        object.object_class = classify(object, metal.lobe_gain, options.unsure_margin);
        log_debug(
            "{}: {} pixels, costs solid {:.4f} (n {:.3f}, seen {:.2f}) shell {:.4f} (seen {:.2f}) "
            "ward {:.4f} (sigma {:.3f}, lobe {:.2f}) diffuse {:.4f}, gain of the lobe {:.3f}",
            object.id, pixels.size(), solid.cost, solid.ior.value, solid.explained, shell.cost,
            shell.explained, ward.cost, ward.sigma.value, ward.lobe_share, ward.cost_diffuse,
            metal.lobe_gain);
        if (override && override->ignore) {
            object.object_class = ObjectClass::Diffuse;
            object.reason = "given: not an object";
        }
        if (override && override->object_class) {
            object.object_class = *override->object_class;
            object.reason = "class given";
        }

        const TransparentFit& clear = shell.cost < solid.cost ? shell : solid;
        object.ior = object.ior_through = clear.ior;
        const bool is_free =
            !transparent.known_ior && transparent.ior_step == 0.0 && transparent.ior_grid.empty();
        if (object.object_class == ObjectClass::Transparent && !clear.is_shell && is_free)
            object.ior = with_caustic(world, lookup, k, lights, clear, transparent);
        object.sigma_a_per_m = clear.sigma_a_per_m;
        object.is_hollow = clear.is_shell;
        object.wall_m = clear.wall_m;
        object.paints = metal.paints;
        object.albedo = ward.albedo;
        if (!has_two_views(pixels)) doubt_all(object, override);
        objects.push_back(object);
    }
    progress.update(1.0);
    return objects;
}

void refit_specular(const Scene& scene, std::span<const RgbdFrame> frames, double saturation_level,
                    const LightEstimate& lights, const MaterialOptions& options,
                    std::vector<ObjectEstimate>& objects, const Progress& progress) {
    const ObjectContext context(scene, frames, saturation_level, lights);
    const EstimationScene& world = context.world;
    const FrameLookup& lookup = context.lookup;
    const double bright = context.bright;
    for (int k = 0; k < world.object_count(); ++k) {
        progress.update(static_cast<double>(k) / world.object_count(), "materials again");
        ObjectEstimate& object = objects[static_cast<std::size_t>(k)];
        if (object.object_class == ObjectClass::Transparent) continue;
        const std::vector<ObjectPixel> pixels = object_pixels(world, lookup, k, options.pixels);
        if (static_cast<int>(pixels.size()) < kMinPixels) continue;
        const ClusteredWard metal =
            fit_ward_clusters(world, pixels, context.light_on(k), bright, options.specular);
        const WardFit& ward = metal.whole;
        object.cost_ward = metal.cost;
        object.cost_diffuse = metal.cost_diffuse;
        object.albedo = ward.albedo;
        object.clusters = metal.clusters;
        object.paints = metal.paints;
        if (!has_two_views(pixels)) doubt_all(object, nullptr);
    }
}

}  // namespace vitrine
