// trace/accel.h: closest hits and occlusion over a set of meshes.
//
// Here double becomes float: the world enters as meshes in metres, rays as Vec3f. A ray never
// starts on its own surface by luck: the caller offsets with `min_distance`.
#pragma once

#include "trace/ray_and_hit.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace vitrine {

struct Ray {
    Vec3f origin;
    Vec3f direction;  ///< need not be unit: distances are in its length
    float min_distance = 0.0f;
    float max_distance = 1e30f;
    std::uint32_t mask = 0xffffffffu;  ///< hits parts with (part mask & ray mask) != 0
};

struct Hit {
    float distance = -1.0f;
    int part = -1;  ///< index of the mesh; -1: nothing hit
    int triangle = -1;
    Vec2f barycentric = Vec2f::Zero();  ///< weights of vertices 1 and 2
    Vec3f normal = Vec3f::Zero();       ///< geometric, unit, outward by the triangle's winding
    bool is_hit() const { return part >= 0; }
};

/// What a ray of a list met, as a ray alone gets it.
inline Hit hit_of(const RayAndHit& answered) {
    Hit hit;
    if (!answered.is_hit()) return hit;
    hit.distance = answered.distance();
    hit.part = answered.part;
    hit.triangle = answered.triangle;
    hit.barycentric = answered.barycentric;
    hit.normal = answered.normal.normalized();
    return hit;
}

struct AccelPart {
    std::shared_ptr<const Mesh> mesh;
    std::uint32_t mask = 0xffffffffu;
};

/// A bounding volume hierarchy (Embree 3) over meshes; immutable, safe to use from all threads,
/// cheap to copy (shared). Building costs about 0.3 s per million triangles; a ray about 0.3 us.
class Accel {
  public:
    Accel() = default;
    /// @throws MachineError when the library cannot be set up or a self-test ray misses.
    explicit Accel(std::vector<AccelPart> parts);

    Hit closest(const Ray& ray) const;
    /// Answers `hits[i]` for each ray. Neighbours of the list that run alike are traced together,
    /// in half the time or less; those that do not cost as much as alone.
    void closest(std::span<const Ray> rays, std::span<Hit> hits) const;
    /// Answers each ray in place.
    /// @param are_alike neighbours are traced together; else one by one
    void closest(const RayList& rays, bool are_alike) const;
    bool is_occluded(const Ray& ray) const;
    /// Answers each ray in place: in two thirds of the time or less, alike or not.
    void occluded(std::span<BareRay> rays) const;

    /// The point of any surface nearest to `point` within `max_distance`: `distance` is Euclidean,
    /// `normal` geometric. Masks are ignored. Costs about 1 us.
    Hit nearest(const Vec3f& point, float max_distance) const;

    const std::vector<AccelPart>& parts() const { return parts_; }
    bool empty() const { return parts_.empty(); }

  private:
    struct Impl;
    std::vector<AccelPart> parts_;
    std::shared_ptr<const Impl> impl_;
};

/// Values of a hit point interpolated over its triangle.
Vec3f hit_point(const Mesh& mesh, const Hit& hit);
/// Unit shading normal (vertex normals if present, else geometric), on the geometric normal's side.
Vec3f shading_normal(const Mesh& mesh, const Hit& hit);
Rgb interpolate_colour(const Mesh& mesh, const Hit& hit);
Vec2f interpolate_uv(const Mesh& mesh, const Hit& hit);

}  // namespace vitrine
