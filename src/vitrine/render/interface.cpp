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

InterfaceEvent cross_interface(const RenderScene& scene, const ShadingPoint& point,
                               const Vec3f& direction, const Media& media) {
    InterfaceEvent event;
    event.beyond = media;
    if (point.is_front) {
        event.beyond.enter(point.part, scene.medium_rank());
    } else {
        event.beyond.leave(point.part);
    }
    // Leaving a body that was never entered (open mesh, start inside): its own index is meant.
    float ior_before = scene.ior(media);
    if (!point.is_front && !media.contains(point.part)) {
        ior_before = static_cast<float>(scene.dielectric(point.part)->ior);
    }
    const float ior_beyond = scene.ior(event.beyond);
    event.eta = ior_beyond / ior_before;
    if (event.eta == 1.0f) {
        event.is_optical = false;
        event.refracted = direction;
        return event;
    }
    const Vec3f wo = -direction;
    Vec3f normal = point.shading_normal;
    // At the outline the rounded surface may face away from a ray that meets the facet.
    if (wo.dot(normal) <= 0) normal = point.geometric_normal;
    float cos_t = 0;
    event.reflectance = fresnel_dielectric(std::min(1.0f, wo.dot(normal)), event.eta, cos_t);
    event.reflected = mirror_direction(point, direction);
    if (event.reflectance < 1.0f) {
        event.refracted = refract(wo, normal, event.eta, cos_t).normalized();
        if (event.refracted.dot(point.geometric_normal) >= 0) {
            const Vec3f& g = point.geometric_normal;
            event.reflectance = fresnel_dielectric(std::min(1.0f, wo.dot(g)), event.eta, cos_t);
            if (event.reflectance < 1.0f) {
                event.refracted = refract(wo, g, event.eta, cos_t).normalized();
            }
        }
    }
    return event;
}

}  // namespace vitrine
