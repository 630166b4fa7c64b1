#include "lamp_glints.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "image/filter.h"
#include "render/interface.h"

#include <random>

namespace vitrine {
namespace {

constexpr float kLeastShare = 1e-4f;
constexpr int kMostInterfaces = 12;

Rgb follow(const RenderScene& scene, const Vec3f& origin, const Vec3f& direction,
           const Media& media, float share, int interfaces) {
    if (share < kLeastShare || interfaces > kMostInterfaces) return Rgb::Zero();
    const Hit hit = scene.closest({origin, direction, 0.0f, 1e30f, kAllParts});
    const float distance = hit.is_hit() ? hit.distance : 1e30f;
    const LightSampler& lights = scene.lights();
    Rgb sum = Rgb::Zero();
    for (std::size_t i = 0; i < lights.count(); ++i) {
        // Lamps seen with nothing in between are no glints.
        if (!lights.can_be_hit(i) || interfaces == 0) continue;
        if (const auto lamp = lights.hit(i, origin, direction, distance)) sum += lamp->radiance;
    }
    if (hit.is_hit() && scene.dielectric(hit.part)) {
        const ShadingPoint point = scene.surface(hit, direction);
        const Boundary boundary = cross_boundary(scene, point.part, point.is_front, media);
        BentRays rays{0.0f, direction, direction};  // where the boundary is not optical
        if (boundary.eta != 1.0f) rays = bend(point, direction, boundary.eta);
        const float reflected = rays.reflectance;
        if (reflected > 0) {
            sum += reflected * follow(scene, scene.leave(point, rays.reflected), rays.reflected,
                                      media, share * reflected, interfaces + 1);
        }
        if (reflected < 1) {
            sum +=
                (1 - reflected) * follow(scene, scene.leave(point, rays.refracted), rays.refracted,
                                         boundary.beyond, share * (1 - reflected), interfaces + 1);
        }
    }
    return sum * scene.transmittance(media, distance);
}

}  // namespace

ImageRgb lamps_in_glass(const RenderScene& scene, const Camera& camera, const Mask& where,
                        int side) {
    ImageRgb result(camera.width, camera.height);
    const Vec3f origin = camera.centre_in_world().cast<float>();
    parallel_for(static_cast<std::size_t>(camera.height), 1, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < camera.width; ++x) {
            if (where(x, y) < 128) continue;
            Rgb sum = Rgb::Zero();
            for (int k = 0; k < side * side; ++k) {
                const double u = x - 0.5 + (k % side + 0.5) / side;
                const double v = y - 0.5 + (k / side + 0.5) / side;
                sum += follow(scene, origin, camera.ray_in_world(u, v).cast<float>(), Media(), 1.0f,
                              0);
            }
            result(x, y) = sum / static_cast<float>(side * side);
        }
    });
    return result;
}

double glint_noise(const ImageRgb& base, const ImageRgb& lamps, const Mask& where, double quantum,
                   float top, double blur_px) {
    constexpr int kDraws = 64;
    const auto shown = [&](const Rgb& value) -> Rgb { return value.max(0.0f).min(top); };
    double sum = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
        std::mt19937_64 random(stream_key(11, unsigned(draw)));
        ImageRgb error(base.width(), base.height());
        for (std::size_t i = 0; i < base.size(); ++i) {
            if (where[i] < 128 || lamps[i][1] <= 0) continue;
            std::poisson_distribution<int> paths(double(lamps[i][1]) / quantum);
            const float found = static_cast<float>(paths(random) * quantum) / lamps[i][1];
            error[i] = shown(base[i] + found * lamps[i]) - shown(base[i] + lamps[i]);
        }
        const ImageRgb blurred = gaussian_blur(error, blur_px);
        double square = 0;
        for (std::size_t i = 0; i < blurred.size(); ++i) {
            if (where[i] > 127) square += blurred[i].square().sum();
        }
        sum += std::sqrt(square) / kDraws;
    }
    return sum;
}

}  // namespace vitrine
