#include "estimate/paper_rule.h"

#include "base/parallel.h"
#include "render/estimation_refraction.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {
constexpr double kAssumedIor = 1.2;  // section 5.2
}

std::vector<ThroughPixel> look_through_plainly(const EstimationScene& scene,
                                               const FrameLookup& lookup, int object,
                                               const std::vector<ObjectPixel>& pixels, double ior) {
    std::vector<ThroughPixel> through(pixels.size());
    parallel_for(pixels.size(), 16, [&](std::size_t i) {
        const RefractedPath path = refract_through(scene, object, pixels[i].eye,
                                                   pixels[i].direction, static_cast<float>(ior));
        if (!path.is_valid) return;
        const Hit hit = scan_behind(scene, path, scene.offset_m());
        if (!hit.is_hit() || hit.normal.dot(path.exit_direction) >= 0.0f) return;
        const Mesh& mesh = scene.mesh(hit.part);
        const std::optional<Rgb> seen =
            lookup.background({hit_point(mesh, hit), shading_normal(mesh, hit)}, -1);
        if (!seen) return;
        through[i].is_valid = true;
        through[i].transmitted = *seen;
        through[i].length_m = path.length_m;
    });
    return through;
}

double PaperRule::margin() const {
    const double b = std::max(std::abs(specular - seen), 1e-9);
    const double t = std::max(std::abs(transparent - seen), 1e-9);
    return std::log(b / t);
}

PaperRule paper_rule(const ObjectContext& context, int object,
                     const std::vector<ObjectPixel>& pixels, double reflectance) {
    const std::vector<ThroughPixel> through =
        look_through_plainly(context.world, context.lookup, object, pixels, kAssumedIor);
    PaperRule rule;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (!through[i].is_valid) continue;
        rule.seen += luminance(pixels[i].radiance);
        rule.transparent += luminance(through[i].transmitted);
        for (const DiscLight& lamp : context.light.lights) {
            const Vec3f to_light = lamp.position_m.cast<float>() - pixels[i].surface.position;
            const double d = to_light.norm();
            const double cosine = std::max(0.0f, pixels[i].surface.normal.dot(to_light)) / d;
            rule.specular += reflectance * luminance(lamp.intensity_w_per_sr) * cosine / (d * d);
        }
    }
    return rule;
}

}  // namespace vitrine
