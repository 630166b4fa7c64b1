#include "estimate/light_data.h"

#include "math/statistics.h"

namespace vitrine {

namespace {

constexpr int kMinSamples = 200;

std::optional<ReferenceSample> find_reference(const EstimationScene& scene,
                                              const FrameLookup& lookup,
                                              const std::optional<ReferenceAlbedo>& reference) {
    if (!reference) return std::nullopt;
    for (std::size_t f = 0; f < lookup.frames().size(); ++f) {
        const RgbdFrame& frame = lookup.frames()[f];
        if (frame.id != reference->frame) continue;
        const Camera& camera = lookup.cameras()[f];
        const Vec3f origin = camera.centre_in_world().cast<float>();
        const Vec3f direction =
            camera.ray_in_world(reference->pixel.x(), reference->pixel.y()).cast<float>();
        const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, kAllMask});
        if (!hit.is_hit() || scene.object_of_part(hit.part) >= 0) return std::nullopt;
        ReferenceSample sample;
        const Mesh& mesh = scene.mesh(hit.part);
        sample.point = {hit_point(mesh, hit), shading_normal(mesh, hit)};
        sample.albedo = reference->albedo;
        for (int c = 0; c < 3; ++c) {
            std::vector<double> patch;
            for (int dy = -2; dy <= 2; ++dy)
                for (int dx = -2; dx <= 2; ++dx)
                    patch.push_back(
                        frame.colour.clamped(static_cast<int>(reference->pixel.x()) + dx,
                                             static_cast<int>(reference->pixel.y()) + dy)[c]);
            sample.radiance[c] = static_cast<float>(median(patch));
        }
        return sample;
    }
    return std::nullopt;
}

}  // namespace

LightData::LightData(const Scene& scene, std::span<const RgbdFrame> frames, double saturation_level,
                     const LightOptions& options)
    : world(scene), lookup(world, scene.cameras, frames, saturation_level) {
    for (int k = 0; k < world.object_count(); ++k) {
        const auto index = static_cast<std::size_t>(k);
        const ObjectClass c = index < options.object_classes.size() ? options.object_classes[index]
                                                                    : ObjectClass::Unsure;
        const bool is_opaque = c == ObjectClass::Specular || c == ObjectClass::Diffuse;
        (is_opaque ? opaque_mask : see_through_mask) |= object_mask(k);
    }
    see_through_mask &= ~opaque_mask;
    samples = sample_scan(world, lookup, see_through_mask, mean_object_radiance(world, lookup),
                          options.samples);
    if (samples.saturated_count > samples.tried_count / 2) {
        problem = "most of the scan is clipped in every picture: expose for the table";
    } else if (static_cast<int>(samples.points.size()) < kMinSamples) {
        problem = "too few scanned points are seen without occlusion";
    } else {
        reference = find_reference(world, lookup, options.reference_albedo);
    }
}

LightEstimate LightData::start_estimate() const {
    LightEstimate estimate;
    estimate.reference_point_m = samples.reference_point;
    estimate.scene_radius_m = samples.scene_radius_m;
    estimate.plane = samples.plane;
    estimate.albedo_anchor = reference ? "reference_albedo" : "mean_albedo";
    estimate.reason = problem;
    return estimate;
}

}  // namespace vitrine
