#include "render/estimation_refraction.h"

#include "optics/fresnel.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {
constexpr float kLeave = 2e-5f;  // metres off a smooth hull: well above float noise at one metre
constexpr int kMaxPasses = 3;    // a ring is crossed twice; more ways carry little light

/// `hit` as an entry when it is on the object.
ObjectEntry entry_at(const EstimationScene& scene, int object, const Hit& hit,
                     const Vec3f& direction) {
    ObjectEntry entry;
    if (!hit.is_hit() || hit.part != scene.part_of_object(object)) return entry;
    const Mesh& mesh = scene.mesh(hit.part);
    entry.is_hit = true;
    entry.point = hit_point(mesh, hit);
    entry.normal = shading_normal(mesh, hit);
    entry.direction = direction;
    entry.is_valid = hit.normal.dot(direction) < 0.0f && entry.normal.dot(direction) < 0.0f;
    return entry;
}
}  // namespace

ObjectEntry enter_object(const EstimationScene& scene, int object, const Vec3f& origin,
                         const Vec3f& direction) {
    const Hit hit = scene.accel().closest({origin, direction, 0.0f, 1e30f, object_mask(object)});
    return entry_at(scene, object, hit, direction);
}

namespace {

/// Adds one way through the body, from outside at `entry` until it is let out, to `path`; false
/// when it never is, or leaks out of a rough mesh.
bool pass_body(const EstimationScene& scene, int object, const ObjectEntry& entry, float ior,
               int& skipped_exits, RefractedPath& path) {
    const Mesh& mesh = scene.mesh(scene.part_of_object(object));
    const std::uint32_t mask = object_mask(object);
    float cos_t = 0.0f;
    const float reflected = fresnel_dielectric(-entry.normal.dot(entry.direction), ior, cos_t);
    path.transmittance *= 1.0f - reflected;
    Vec3f inside = refract(-entry.direction, entry.normal, ior, cos_t).normalized();
    Vec3f at = entry.point;
    for (int bounce = 0; bounce <= kMaxInternalReflections; ++bounce) {
        const Hit hit = scene.accel().closest({at, inside, kLeave, 1e30f, mask});
        if (!hit.is_hit() || hit.normal.dot(inside) <= 0.0f) return false;
        const Vec3f normal = shading_normal(mesh, hit);
        const float cos_i = normal.dot(inside);
        if (cos_i <= 0.0f) return false;
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
            path.internal_reflections += bounce;
            return true;
        }
        inside = (inside - 2.0f * cos_i * normal).normalized();
    }
    return false;
}

/// Where a ray that left the body meets it again before the scan, as at a ring's far side.
ObjectEntry meet_again(const EstimationScene& scene, int object, const RefractedPath& path) {
    const Accel& accel = scene.accel();
    const std::uint32_t mask = object_mask(object);
    ObjectEntry entry;
    if (!accel.is_occluded({path.exit, path.exit_direction, kLeave, 1e30f, mask})) return entry;
    const Hit hit =
        accel.closest({path.exit, path.exit_direction, kLeave, 1e30f, mask | kScanMask});
    return entry_at(scene, object, hit, path.exit_direction);
}

}  // namespace

RefractedPath refract_from(const EstimationScene& scene, int object, const ObjectEntry& entry,
                           float ior, int skipped_exits) {
    RefractedPath path;
    path.entry = entry.point;
    path.entry_normal = entry.normal;
    if (!entry.is_valid) return path;
    path.entry_reflectance = fresnel_dielectric(-entry.normal.dot(entry.direction), ior);
    path.transmittance = 1.0f;
    ObjectEntry next = entry;
    for (int pass = 0; pass < kMaxPasses && next.is_valid; ++pass) {
        if (!pass_body(scene, object, next, ior, skipped_exits, path)) return path;
        next = meet_again(scene, object, path);
    }
    path.is_valid = true;
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
