// What is seen through glass of a trial index or wall; declared in estimate/transparent.h.
#include "base/parallel.h"
#include "estimate/beyond_scan.h"
#include "estimate/transparent.h"
#include "estimate/vessel.h"
#include "optics/fresnel.h"
#include "render/estimation_refraction.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr int kRays = 2;  // side of the square of rays in a pixel

/// `share` of what comes from there: of the scan's radiance, or of whatever lies beyond it.
void add_surroundings(const EstimationScene& scene, const Vec3f& origin, const Vec3f& direction,
                      float share, Rgb& from_scan, float& from_beyond) {
    const Hit hit = scene.accel().closest({origin, direction, 1e-4f, 1e30f, kScanMask});
    if (const std::optional<Rgb> seen = scene.scan_radiance(hit, direction)) {
        from_scan += share * *seen;
    } else {
        from_beyond += share;
    }
}

/// One ray of a pixel.
template <typename Trace, typename TraceInner>
ThroughPixel predict_ray(const EstimationScene& scene, const FrameLookup& lookup, const Vec3f& eye,
                         const Vec3f& direction, const Trace& trace,
                         const TraceInner& trace_inner) {
    ThroughPixel result;
    const RefractedPath path = trace(eye, direction);
    if (!path.is_valid) return result;
    const Hit hit = scan_behind(scene, path, scene.offset_m());
    if (hit.is_hit()) {
        if (hit.normal.dot(path.exit_direction) >= 0.0f) return result;
        const Mesh& mesh = scene.mesh(hit.part);
        const std::optional<Rgb> seen =
            lookup.background({hit_point(mesh, hit), shading_normal(mesh, hit)}, -1);
        if (!seen) return result;
        result.transmitted = path.transmittance * *seen;
    } else {
        result.beyond.transmitted = path.transmittance;
    }
    const RefractedPath inner = trace_inner(eye, direction);
    if (inner.is_valid) {
        add_surroundings(scene, inner.exit, inner.exit_direction, inner.transmittance, result.inner,
                         result.beyond.inner);
        result.inner_length_m = inner.length_m;
    }
    add_surroundings(scene, path.entry, reflect(-direction, path.entry_normal),
                     path.entry_reflectance, result.reflected, result.beyond.reflected);
    result.length_m = path.length_m;
    result.is_valid = true;
    return result;
}

void add_share(const ThroughPixel& of, float share, ThroughPixel& sum) {
    sum.transmitted += share * of.transmitted;
    sum.reflected += share * of.reflected;
    sum.inner += share * of.inner;
    sum.length_m += share * of.length_m;
    sum.inner_length_m += share * of.inner_length_m;
    sum.beyond.transmitted += share * of.beyond.transmitted;
    sum.beyond.reflected += share * of.beyond.reflected;
    sum.beyond.inner += share * of.beyond.inner;
}

/// Mean over a square of rays in every pixel: glass turns a pixel into a wide patch of what lies
/// behind, or a small one.
template <typename Trace, typename TraceInner>
std::vector<ThroughPixel> predict(const EstimationScene& scene, const FrameLookup& lookup,
                                  const std::vector<ObjectPixel>& pixels, const Rgb& ambient,
                                  const Trace& trace, const TraceInner& trace_inner) {
    std::vector<ThroughPixel> result(pixels.size());
    parallel_for(pixels.size(), 16, [&](std::size_t i) {
        const ObjectPixel& pixel = pixels[i];
        const Camera& camera = lookup.cameras()[static_cast<std::size_t>(pixel.frame)];
        ThroughPixel sum;
        int valid = 0;
        for (int k = 0; k < kRays * kRays; ++k) {
            const double du = (k % kRays + 0.5) / kRays - 0.5;
            const double dv = (k / kRays + 0.5) / kRays - 0.5;
            const Vec3f direction = camera.ray_in_world(pixel.u + du, pixel.v + dv).cast<float>();
            const ThroughPixel ray =
                predict_ray(scene, lookup, pixel.eye, direction, trace, trace_inner);
            if (!ray.is_valid) continue;
            ++valid;
            add_share(ray, 1.0f, sum);
        }
        if (2 * valid <= kRays * kRays) return;
        add_share(sum, 1.0f / static_cast<float>(valid), result[i]);
        result[i].is_valid = true;
    });
    add_beyond(result, ambient);
    return result;
}

}  // namespace

std::vector<ThroughPixel> look_through(const EstimationScene& scene, const FrameLookup& lookup,
                                       int object, const std::vector<ObjectPixel>& pixels,
                                       double ior, const Rgb& ambient) {
    return predict(
        scene, lookup, pixels, ambient,
        [&](const Vec3f& eye, const Vec3f& direction) {
            return refract_through(scene, object, eye, direction, static_cast<float>(ior));
        },
        [&](const Vec3f& eye, const Vec3f& direction) {
            return refract_through(scene, object, eye, direction, static_cast<float>(ior), 1);
        });
}

std::vector<ThroughPixel> look_through_vessel(const EstimationScene& scene,
                                              const FrameLookup& lookup, int object,
                                              const std::vector<ObjectPixel>& pixels, double ior,
                                              double wall_m, const Rgb& ambient) {
    const Vessel vessel(scene.mesh(scene.part_of_object(object)), wall_m);
    return predict(
        scene, lookup, pixels, ambient,
        [&](const Vec3f& eye, const Vec3f& direction) {
            return vessel.pass(eye, direction, static_cast<float>(ior));
        },
        [](const Vec3f&, const Vec3f&) { return RefractedPath{}; });
}

}  // namespace vitrine
