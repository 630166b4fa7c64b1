#include "estimate/object_pixels.h"

#include "base/parallel.h"
#include "math/statistics.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

/// Index of the candidate first met through each pixel of a box around the object; -1: another.
struct Silhouette {
    int u0 = 0, v0 = 0, width = 0, height = 0;
    std::vector<char> inside;
    bool operator()(int u, int v) const {
        const int x = u - u0, y = v - v0;
        return x >= 0 && y >= 0 && x < width && y < height &&
               inside[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)] != 0;
    }
};

Silhouette silhouette_of(const EstimationScene& scene, const Camera& camera, int object) {
    Silhouette s;
    const Box3& box = scene.object_bounds(object);
    Vec2 low(1e9, 1e9), high(-1e9, -1e9);
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 p((corner & 1) ? box.max.x() : box.min.x(),
                     (corner & 2) ? box.max.y() : box.min.y(),
                     (corner & 4) ? box.max.z() : box.min.z());
        if (camera.depth(p) <= 0.01) return s;
        const Vec2 uv = camera.project(p);
        low = low.cwiseMin(uv);
        high = high.cwiseMax(uv);
    }
    s.u0 = std::clamp(static_cast<int>(std::floor(low.x())), 0, camera.width);
    s.v0 = std::clamp(static_cast<int>(std::floor(low.y())), 0, camera.height);
    s.width = std::clamp(static_cast<int>(std::ceil(high.x())) + 1, 0, camera.width) - s.u0;
    s.height = std::clamp(static_cast<int>(std::ceil(high.y())) + 1, 0, camera.height) - s.v0;
    if (s.width <= 0 || s.height <= 0) return Silhouette{};
    s.inside.assign(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height), 0);
    const Vec3f eye = camera.centre_in_world().cast<float>();
    const int part = scene.part_of_object(object);
    parallel_for(static_cast<std::size_t>(s.height), 4, [&](std::size_t y) {
        for (int x = 0; x < s.width; ++x) {
            const Vec3f direction =
                camera.ray_in_world(s.u0 + x, s.v0 + static_cast<int>(y)).cast<float>();
            const Hit hit = scene.accel().closest({eye, direction, 0.0f, 1e30f, kAllMask});
            s.inside[y * static_cast<std::size_t>(s.width) + static_cast<std::size_t>(x)] =
                hit.part == part;
        }
    });
    return s;
}

/// A square of side one pixel over a normal that turns by `du` and `dv` from pixel to pixel.
/// Twice the lesser of the two principal variances: where a ring turns sharply one way, its
/// highlight is told by the other, and the lobe fitted is no wider than that makes it.
float variance_within(const Vec3f& du, const Vec3f& dv) {
    const float uu = du.squaredNorm(), vv = dv.squaredNorm(), uv = du.dot(dv);
    const float least = 0.5f * (uu + vv) - std::sqrt(0.25f * (uu - vv) * (uu - vv) + uv * uv);
    return std::max(0.0f, least) / 6.0f;
}

bool is_deep_inside(const Silhouette& s, int u, int v, int border) {
    for (const auto& [du, dv] : {std::pair{border, 0}, std::pair{-border, 0}, std::pair{0, border},
                                 std::pair{0, -border}, std::pair{0, 0}})
        if (!s(u + du, v + dv)) return false;
    return true;
}

}  // namespace

std::vector<ObjectPixel> object_pixels(const EstimationScene& scene, const FrameLookup& lookup,
                                       int object, const ObjectPixelOptions& options) {
    std::vector<ObjectPixel> pixels;
    const Mesh& mesh = scene.mesh(scene.part_of_object(object));
    for (std::size_t f = 0; f < lookup.frames().size(); ++f) {
        const Camera& camera = lookup.cameras()[f];
        const ImageRgb& colour = lookup.frames()[f].colour;
        const Silhouette s = silhouette_of(scene, camera, object);
        const auto area = static_cast<double>(std::count(s.inside.begin(), s.inside.end(), 1));
        const int stride =
            std::max(1, static_cast<int>(std::ceil(std::sqrt(area / options.pixels_per_view))));
        const Vec3f eye = camera.centre_in_world().cast<float>();
        for (int v = s.v0; v < s.v0 + s.height; v += stride) {
            for (int u = s.u0; u < s.u0 + s.width; u += stride) {
                if (!is_deep_inside(s, u, v, options.border_px)) continue;
                ObjectPixel pixel;
                pixel.frame = static_cast<int>(f);
                pixel.u = u;
                pixel.v = v;
                pixel.eye = eye;
                pixel.direction = camera.ray_in_world(u, v).cast<float>();
                const Hit hit =
                    scene.accel().closest({eye, pixel.direction, 0.0f, 1e30f, kAllMask});
                if (!hit.is_hit()) continue;
                pixel.surface = {hit_point(mesh, hit), shading_normal(mesh, hit)};
                const auto normal_at = [&](int du, int dv) -> Vec3f {
                    const Vec3f ray = camera.ray_in_world(u + du, v + dv).cast<float>();
                    const Hit near = scene.accel().closest({eye, ray, 0.0f, 1e30f, kAllMask});
                    return near.part == hit.part ? shading_normal(mesh, near)
                                                 : pixel.surface.normal;
                };
                pixel.turn_u = 0.5f * (normal_at(1, 0) - normal_at(-1, 0));
                pixel.turn_v = 0.5f * (normal_at(0, 1) - normal_at(0, -1));
                pixel.normal_variance = variance_within(pixel.turn_u, pixel.turn_v);
                pixel.radiance = colour(u, v);
                for (int c = 0; c < 3; ++c)
                    pixel.is_at_least[static_cast<std::size_t>(c)] =
                        is_saturated(Rgb::Constant(pixel.radiance[c]), lookup.saturation_level());
                for (int dv = -1; dv <= 1; ++dv)
                    for (int du = -1; du <= 1; ++du)
                        pixel.is_clipped |= lookup.is_clipped(colour.clamped(u + du, v + dv));
                pixels.push_back(pixel);
            }
        }
    }
    return pixels;
}

double bright_level(const FrameLookup& lookup) {
    constexpr int kStride = 7;
    std::vector<double> values;
    for (const RgbdFrame& frame : lookup.frames())
        for (int v = 0; v < frame.colour.height(); v += kStride)
            for (int u = 0; u < frame.colour.width(); u += kStride)
                values.push_back(luminance(frame.colour(u, v)));
    return values.empty() ? 1.0 : std::max(1e-6, quantile(values, 0.9));
}

}  // namespace vitrine
