// trace/ray_and_hit.h: rays laid out as the ray tracing library wants them, so that it answers a
// list of them in place and nothing is copied. For those who send very many; others use `Ray`.
#pragma once

#include "geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace vitrine {

/// A ray alone, to ask whether its way is free.
struct alignas(16) BareRay {
    BareRay() = default;
    BareRay(const Vec3f& from, const Vec3f& along, float to, std::uint32_t its_mask)
        : origin(from), direction(along), max_distance(to), mask(its_mask) {}

    Vec3f origin;
    float min_distance = 0.0f;
    Vec3f direction;  ///< need not be unit: distances are in its length
    float time = 0.0f;
    float max_distance = 1e30f;        ///< once answered: negative where something is in the way
    std::uint32_t mask = 0xffffffffu;  ///< hits parts with (part mask & ray mask) != 0
    std::uint32_t id = 0, flags = 0;

    bool is_hidden() const { return max_distance < 0; }
};

/// A ray and, once it is answered, what it met first.
struct alignas(16) RayAndHit {
    RayAndHit() = default;
    RayAndHit(const Vec3f& from, const Vec3f& along, std::uint32_t its_mask)
        : ray(from, along, 1e30f, its_mask) {}

    BareRay ray;        ///< `max_distance`: to the hit
    Vec3f normal;       ///< geometric, outward by the triangle's winding, of any length
    Vec2f barycentric;  ///< weights of vertices 1 and 2
    std::int32_t triangle;
    std::int32_t part = -1;  ///< index of the mesh; -1: nothing hit
    std::int32_t instance = -1;

    bool is_hit() const { return part >= 0; }
    float distance() const { return ray.max_distance; }
};

/// Rays one after the other, or each at the beginning of an item that holds more.
class RayList {
  public:
    RayList(std::span<RayAndHit> rays) : RayList(rays.data(), rays.size(), sizeof(RayAndHit)) {}
    /// @param items with a `ray` at their beginning
    template <typename Item>
    static RayList of(std::span<Item> items) {
        static_assert(offsetof(Item, ray) == 0);
        return {items.empty() ? nullptr : &items.front().ray, items.size(), sizeof(Item)};
    }
    std::size_t size() const { return count_; }
    std::size_t stride_bytes() const { return stride_bytes_; }
    RayAndHit* data() const { return first_; }
    RayAndHit& operator[](std::size_t i) const {
        return *reinterpret_cast<RayAndHit*>(reinterpret_cast<std::byte*>(first_) +
                                             i * stride_bytes_);
    }

  private:
    RayList(RayAndHit* first, std::size_t count, std::size_t stride_bytes)
        : first_(first), count_(count), stride_bytes_(stride_bytes) {}
    RayAndHit* first_;
    std::size_t count_, stride_bytes_;
};

}  // namespace vitrine
