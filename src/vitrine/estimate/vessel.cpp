#include "estimate/vessel.h"

#include "optics/fresnel.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {
constexpr float kLeave = 2e-5f;     // metres off a surface: well above float noise at one metre
constexpr int kMaxInterfaces = 16;  // two walls take four; more are ways along a wall
constexpr double kWeld = 1e-6;      // metres: vertices that a crease has split
}  // namespace

Mesh shell_of(const Mesh& hull, double wall_m) {
    // Split creases would tear when moved along their normals: weld, and crease again.
    Mesh shell = hull;
    shell.normals.clear();
    shell.colours.clear();
    shell.uv.clear();
    shell = welded(shell, kWeld);
    const std::vector<Vec3f> normals = vertex_normals(shell);
    const auto count = static_cast<int>(shell.vertices.size());
    const std::size_t triangles = shell.triangles.size();
    for (int i = 0; i < count; ++i)
        shell.vertices.push_back(shell.vertices[static_cast<std::size_t>(i)] -
                                 static_cast<float>(wall_m) * normals[static_cast<std::size_t>(i)]);
    for (std::size_t t = 0; t < triangles; ++t) {
        const Triangle outer = shell.triangles[t];
        shell.triangles.emplace_back(outer[0] + count, outer[2] + count, outer[1] + count);
    }
    return with_creased_normals(shell, 40.0);
}

Vessel::Vessel(const Mesh& hull, double wall_m)
    : mesh_(std::make_shared<const Mesh>(shell_of(hull, wall_m))),
      accel_(std::vector<AccelPart>{{mesh_}}) {}

RefractedPath Vessel::pass(const Vec3f& origin, const Vec3f& direction, float ior) const {
    RefractedPath path;
    path.transmittance = 1.0f;
    Vec3f at = origin, along = direction;
    for (int k = 0; k < kMaxInterfaces; ++k) {
        const Hit hit = accel_.closest({at, along, k == 0 ? 0.0f : kLeave, 1e30f});
        if (!hit.is_hit()) {
            path.is_valid = k > 0;
            path.exit = at;
            path.exit_direction = along;
            return path;
        }
        Vec3f normal = shading_normal(*mesh_, hit);
        const bool is_entering = hit.normal.dot(along) < 0.0f;
        if (!is_entering) normal = -normal;
        const float cos_i = -normal.dot(along);
        if (cos_i <= 0.0f) return path;  // bent normals at a silhouette
        if (!is_entering) path.length_m += hit.distance;
        at = hit_point(*mesh_, hit);
        float cos_t = 0.0f;
        const float eta = is_entering ? ior : 1.0f / ior;
        const float reflectance = fresnel_dielectric(std::min(cos_i, 1.0f), eta, cos_t);
        if (k == 0) {
            path.entry = at;
            path.entry_normal = normal;
            path.entry_reflectance = 2.0f * reflectance / (1.0f + reflectance);  // both faces
        }
        if (cos_t > 0.0f) {
            path.transmittance *= 1.0f - reflectance;
            along = refract(-along, normal, eta, cos_t).normalized();
        } else {
            along = (along + 2.0f * cos_i * normal).normalized();
            ++path.internal_reflections;
        }
    }
    return path;
}

}  // namespace vitrine
