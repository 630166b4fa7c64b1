// render/render_scene.h: a `Scene` made ready for tracing rays: hierarchy, lights, media.
#pragma once

#include "render/bsdf.h"
#include "render/light_sampler.h"
#include "render/translucent_body.h"
#include "scene/scene.h"
#include "trace/accel.h"

#include <span>

namespace vitrine {

/// Ray masks: which parts a ray can see.
constexpr std::uint32_t kRealParts = 1;
constexpr std::uint32_t kVirtualParts = 2;
constexpr std::uint32_t kAllParts = kRealParts | kVirtualParts;

/// The dielectrics a path is inside of. Where bodies overlap, the one of smallest volume displaces
/// the others: a bubble in a block, the thin wall of a glass against the drink poured into it.
class Media {
  public:
    static constexpr int kNone = -1;

    /// Part whose medium fills the place, or kNone for air.
    int current() const { return count_ > 0 ? parts_[0] : kNone; }
    bool contains(int part) const;
    /// @param rank order of precedence per part: lower displaces higher
    void enter(int part, const std::vector<int>& rank);
    void leave(int part);
    bool operator==(const Media& other) const {
        return std::equal(parts_, parts_ + count_, other.parts_, other.parts_ + other.count_);
    }

  private:
    static constexpr int kCapacity = 6;   // more bodies inside each other are not told apart
    std::int16_t parts_[kCapacity] = {};  // sorted by rank
    std::int16_t count_ = 0;
};

/// A surface point that a ray has met, seen from where the ray came.
struct ShadingPoint {
    int part = -1;
    float distance = 0.0f;
    Vec3f position = Vec3f::Zero();
    Vec3f geometric_normal = Vec3f::Zero();  ///< towards the ray's origin
    Vec3f shading_normal = Vec3f::Zero();    ///< on the side of geometric_normal
    Vec3f smooth_position = Vec3f::Zero();   ///< lifted to the rounded surface, for shadow rays
    bool is_front = true;                    ///< the ray came from outside the mesh
};

/// What is read of a part at every hit, in one place.
struct PartShape {
    const Triangle* triangles;
    const Vec3f* vertices;
    const Vec3f* normals;  ///< null: flat, or with normals that are those of its facets
    const Rgb* colours;    ///< null: none
    bool is_diffuse;       ///< a plain diffuse surface, of `Material` Diffuse
    bool is_dielectric;
    bool has_one_albedo;  ///< of these: `albedo` everywhere
    Rgb albedo;
};

class RenderScene {
  public:
    RenderScene() = default;
    /// Copies the scene's values (meshes are shared). Parts with `is_virtual` answer only to rays
    /// whose mask has kVirtualParts. Glass that touches something opaque is set off from it by a
    /// gap of a few ray epsilons (optical contact needs a liquid; a table has air in between), so
    /// that no ray slips through both surfaces at once.
    explicit RenderScene(Scene scene);
    /// `world` and virtual parts beside it, which are `is_virtual` from here on. The world's
    /// hierarchy is shared and not built again: takes milliseconds where the world took a second.
    RenderScene(const RenderScene& world, std::vector<Part> virtual_parts);

    const Scene& scene() const { return scene_; }
    /// Of the parts of the scene that was given, without those added later: rays ask `closest` and
    /// `is_occluded`, which know all.
    const Accel& accel() const { return accel_; }
    Hit closest(const Ray& ray) const {
        Hit hit = accel_.closest(ray);
        if (added_accel_.empty() || !(ray.mask & kVirtualParts)) return hit;
        Ray nearer = ray;
        if (hit.is_hit()) nearer.max_distance = hit.distance;
        Hit added = added_accel_.closest(nearer);
        if (!added.is_hit()) return hit;
        added.part += static_cast<int>(accel_.parts().size());
        return added;
    }
    /// Of many rays; see `Accel::closest`.
    void closest(std::span<const Ray> rays, std::span<Hit> hits) const;
    void closest(const RayList& rays, bool are_alike) const {
        accel_.closest(rays, are_alike);
        if (!added_accel_.empty()) add_closest(rays, are_alike);
    }
    bool is_occluded(const Ray& ray) const {
        if (accel_.is_occluded(ray)) return true;
        return !added_accel_.empty() && (ray.mask & kVirtualParts) && added_accel_.is_occluded(ray);
    }
    /// Of many rays; see `Accel::occluded`.
    void occluded(std::span<BareRay> rays) const;
    /// As `Accel::nearest`.
    Hit nearest(const Vec3f& point, float max_distance) const {
        const Hit hit = accel_.nearest(point, max_distance);
        Hit added = added_accel_.nearest(point, hit.is_hit() ? hit.distance : max_distance);
        if (!added.is_hit()) return hit;
        added.part += static_cast<int>(accel_.parts().size());
        return added;
    }
    const LightSampler& lights() const { return lights_; }
    float epsilon() const { return epsilon_; }
    const Sphere& bounding_sphere() const { return bounding_sphere_; }
    const std::vector<int>& medium_rank() const { return medium_rank_; }
    const Material& material(int part) const {
        return scene_.parts[static_cast<std::size_t>(part)].material;
    }
    const PartShape& shape(int part) const { return shapes_[static_cast<std::size_t>(part)]; }
    bool is_virtual(int part) const {
        return scene_.parts[static_cast<std::size_t>(part)].is_virtual;
    }
    const Dielectric* dielectric(int part) const {
        return part < 0 ? nullptr : std::get_if<Dielectric>(&material(part));
    }
    float ior(const Media& media) const {
        const Dielectric* medium = dielectric(media.current());
        return medium ? static_cast<float>(medium->ior) : 1.0f;
    }
    /// The translucent body that a part is; null for all other materials.
    const TranslucentBody* body(int part) const {
        return bodies_[static_cast<std::size_t>(part)].get();
    }
    bool has_bodies() const;
    bool has_virtual() const;
    /// exp(-sigma_a distance) of the medium a path is in.
    Rgb transmittance(const Media& media, float distance) const;

    /// More than the caches near a core hold: surfaces to be met are better asked for ahead.
    bool is_large() const { return triangle_count_ > 50'000; }
    /// Asks memory for what `surface` and `bsdf` will read; the second needs what the first asks
    /// for.
    /// @param hit a Hit or a RayAndHit
    template <typename AnyHit>
    void prefetch_triangle(const AnyHit& hit) const {
        if (hit.is_hit()) __builtin_prefetch(shape(hit.part).triangles + hit.triangle);
    }
    template <typename AnyHit>
    void prefetch_vertices(const AnyHit& hit) const {
        if (!hit.is_hit()) return;
        const PartShape& s = shape(hit.part);
        const Triangle& t = s.triangles[hit.triangle];
        for (int k = 0; k < 3; ++k) {
            __builtin_prefetch(s.vertices + t[k]);
            if (s.normals) __builtin_prefetch(s.normals + t[k]);
            if (s.colours) __builtin_prefetch(s.colours + t[k]);
        }
    }
    /// The surface that `hit` of a ray found.
    ShadingPoint surface(const Hit& hit, const Vec3f& ray_direction) const;
    /// Scattering of an opaque or mirror part at a point; dielectrics need the media and are not
    /// answered here.
    Bsdf bsdf(const ShadingPoint& point, const Hit& hit) const;
    /// rho_d, or the albedo of a translucent body's profile; zero for glass and mirrors.
    Rgb diffuse_albedo(int part, const Hit& hit) const;

    /// Start of a ray that leaves `point` towards `direction`, off the surface by epsilon.
    Vec3f leave(const ShadingPoint& point, const Vec3f& direction) const {
        const float side = direction.dot(point.geometric_normal) < 0 ? -epsilon_ : epsilon_;
        return point.position + side * point.geometric_normal;
    }
    /// As `leave`, for the bright side of opaque surfaces: starts on the rounded surface that the
    /// shading normals describe, so that facets do not shade themselves at the terminator.
    Vec3f leave_smooth(const ShadingPoint& point) const {
        return point.smooth_position + epsilon_ * point.geometric_normal;
    }

  private:
    void measure_parts();
    /// What rays meet of the parts added later, if it is nearer than what they have met.
    void add_closest(const RayList& rays, bool are_alike) const;

    Scene scene_;
    Accel accel_;
    Accel added_accel_;  // of the parts behind those of accel_
    LightSampler lights_;
    Sphere bounding_sphere_;
    std::vector<double> volumes_m3_;
    std::vector<int> medium_rank_;
    std::vector<PartShape> shapes_;
    std::size_t triangle_count_ = 0;
    std::vector<std::shared_ptr<const TranslucentBody>> bodies_;  // per part
    float epsilon_ = 1e-6f;
};

}  // namespace vitrine
