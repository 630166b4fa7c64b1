#include "render/interface.h"

#include "optics/fresnel.h"

namespace vitrine {

Vec3f mirror_direction(const ShadingPoint& point, const Vec3f& direction) {
    Vec3f reflected = reflect(-direction, point.shading_normal);
    if (reflected.dot(point.geometric_normal) <= 0) {
        reflected = reflect(-direction, point.geometric_normal);
    }
    return reflected.normalized();
}

Boundary cross_boundary(const RenderScene& scene, int part, bool is_front, const Media& media) {
    Boundary boundary{media, 1.0f};
    if (is_front) {
        boundary.beyond.enter(part, scene.medium_rank());
    } else {
        boundary.beyond.leave(part);
    }
    // Leaving a body that was never entered (open mesh, start inside): its own index is meant.
    float ior_before = scene.ior(media);
    if (!is_front && !media.contains(part)) {
        ior_before = static_cast<float>(scene.dielectric(part)->ior);
    }
    boundary.eta = scene.ior(boundary.beyond) / ior_before;
    return boundary;
}

BentRays bend(const ShadingPoint& point, const Vec3f& direction, float eta) {
    BentRays rays;
    const Vec3f wo = -direction;
    Vec3f normal = point.shading_normal;
    // At the outline the rounded surface may face away from a ray that meets the facet.
    if (wo.dot(normal) <= 0) normal = point.geometric_normal;
    float cos_t = 0;
    rays.reflectance = fresnel_dielectric(std::min(1.0f, wo.dot(normal)), eta, cos_t);
    rays.reflected = mirror_direction(point, direction);
    if (rays.reflectance < 1.0f) {
        rays.refracted = refract(wo, normal, eta, cos_t).normalized();
        if (rays.refracted.dot(point.geometric_normal) >= 0) {
            const Vec3f& g = point.geometric_normal;
            rays.reflectance = fresnel_dielectric(std::min(1.0f, wo.dot(g)), eta, cos_t);
            if (rays.reflectance < 1.0f) rays.refracted = refract(wo, g, eta, cos_t).normalized();
        }
    }
    return rays;
}

}  // namespace vitrine
