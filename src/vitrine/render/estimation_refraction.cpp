#include "render/estimation_refraction.h"

#include "optics/fresnel.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {
constexpr float kLeave = 2e-5f;  // metres off a smooth hull: well above float noise at one metre
}

ObjectEntry enter_object(const EstimationScene& scene, int object, const Vec3f& origin,
                         const Vec3f& direction) {
    ObjectEntry entry;
    const Mesh& mesh = scene.mesh(scene.part_of_object(object));
    const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, object_mask(object)});
    if (!hit.is_hit()) return entry;
    entry.is_hit = true;
    entry.point = hit_point(mesh, hit);
    entry.normal = shading_normal(mesh, hit);
    entry.direction = direction;
    entry.is_valid = hit.normal.dot(direction) < 0.0f && entry.normal.dot(direction) < 0.0f;
    return entry;
}

RefractedPath refract_from(const EstimationScene& scene, int object, const ObjectEntry& entry,
                           float ior, int skipped_exits) {
    RefractedPath path;
    path.entry = entry.point;
    path.entry_normal = entry.normal;
    if (!entry.is_valid) return path;
    const Mesh& mesh = scene.mesh(scene.part_of_object(object));
    const std::uint32_t mask = object_mask(object);
    Vec3f normal = entry.normal;
    const Vec3f& direction = entry.direction;

    float cos_t = 0.0f;
    path.entry_reflectance = fresnel_dielectric(-normal.dot(direction), ior, cos_t);
    path.transmittance = 1.0f - path.entry_reflectance;
    Vec3f inside = refract(-direction, normal, ior, cos_t).normalized();
    Vec3f at = path.entry;
    for (int bounce = 0; bounce <= kMaxInternalReflections; ++bounce) {
        const Hit hit = scene.accel().closest({at, inside, kLeave, 1e30f, mask});
        if (!hit.is_hit() || hit.normal.dot(inside) <= 0.0f) return path;  // leak of a rough mesh
        normal = shading_normal(mesh, hit);
        const float cos_i = normal.dot(inside);
        if (cos_i <= 0.0f) return path;
        at = hit_point(mesh, hit);
        path.length_m += hit.distance;
        const float reflectance = fresnel_dielectric(std::min(cos_i, 1.0f), 1.0f / ior, cos_t);
        if (cos_t > 0.0f && skipped_exits > 0) {
            --skipped_exits;
            path.transmittance *= reflectance;
        } else if (cos_t > 0.0f) {
            path.transmittance *= 1.0f - reflectance;
            path.exit = at;
            path.exit_direction = refract(-inside, Vec3f(-normal), 1.0f / ior, cos_t).normalized();
            path.internal_reflections = bounce;
            path.is_valid = true;
            return path;
        }
        inside = (inside - 2.0f * cos_i * normal).normalized();
    }
    return path;
}

RefractedPath refract_through(const EstimationScene& scene, int object, const Vec3f& origin,
                              const Vec3f& direction, float ior, int skipped_exits) {
    return refract_from(scene, object, enter_object(scene, object, origin, direction), ior,
                        skipped_exits);
}

RefractedPath pass_through_shell(const EstimationScene& scene, int object, const Vec3f& origin,
                                 const Vec3f& direction, float ior, float wall_m) {
    RefractedPath path;
    const Mesh& mesh = scene.mesh(scene.part_of_object(object));
    const std::uint32_t mask = object_mask(object);
    path.transmittance = 1.0f;
    path.exit_direction = direction;
    Vec3f at = origin;
    for (int wall = 0; wall < 8; ++wall) {
        const Hit hit = scene.accel().closest({at, direction, kLeave, 1e30f, mask});
        if (!hit.is_hit()) break;
        const Vec3f normal = shading_normal(mesh, hit);
        const float cos_i = std::abs(normal.dot(direction));
        float cos_t = 0.0f;
        const float r = fresnel_dielectric(cos_i, ior, cos_t);
        at = hit_point(mesh, hit);
        if (!path.is_valid) {
            path.entry = at;
            path.entry_normal = hit.normal.dot(direction) < 0.0f ? normal : Vec3f(-normal);
            path.entry_reflectance = 2.0f * r / (1.0f + r);  // both faces of the wall
        }
        path.transmittance *= (1.0f - r) / (1.0f + r);  // incoherent slab, all orders
        path.length_m += wall_m / std::max(cos_t, 0.05f);
        path.exit = at;
        path.is_valid = true;
    }
    return path;
}

Hit scan_behind(const EstimationScene& scene, const RefractedPath& path, float back_m) {
    return scene.accel().closest(
        {path.exit - back_m * path.exit_direction, path.exit_direction, 0.0f, 1e30f, kScanMask});
}

}  // namespace vitrine
