// render/estimation_scene.h: a reconstructed scene made ready for estimation: which part is the
// scan, which are candidate objects, and rays that tell them apart.
//
// The scan's vertex colours hold the *observed* linear radiance, so light that bounces is known
// before any light or albedo is: it is gathered, not simulated.
#pragma once

#include "scene/scene.h"
#include "trace/accel.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace vitrine {

/// Ray masks: the scan is bit 0, candidate k bit 1 + k (candidates beyond 30 share the last bit).
constexpr std::uint32_t kScanMask = 1u;
constexpr std::uint32_t kAllMask = 0xffffffffu;
std::uint32_t object_mask(int object);

/// True for the parts that reconstruction names "object_0", "object_1", ...
bool is_candidate(const Part& part);

/// Values only, cheap to copy. Holds pointers to the meshes of `scene`, not to the scene.
class EstimationScene {
  public:
    explicit EstimationScene(const Scene& scene);

    const Accel& accel() const { return accel_; }
    int object_count() const { return static_cast<int>(object_parts_.size()); }
    int part_of_object(int object) const { return object_parts_[static_cast<std::size_t>(object)]; }
    /// -1 for the scan.
    int object_of_part(int part) const { return object_of_part_[static_cast<std::size_t>(part)]; }
    const Mesh& mesh(int part) const {
        return *accel_.parts()[static_cast<std::size_t>(part)].mesh;
    }
    const Box3& object_bounds(int object) const {
        return object_bounds_[static_cast<std::size_t>(object)];
    }
    /// How far a shadow ray starts off a scanned surface, in metres: above the scan's noise.
    float offset_m() const { return offset_m_; }

    /// Observed radiance where a ray first meets the scan; 0 from behind, nothing on a miss.
    std::optional<Rgb> scan_radiance(const Hit& hit, const Vec3f& direction) const;

  private:
    Accel accel_;
    std::vector<int> object_parts_, object_of_part_;
    std::vector<Box3> object_bounds_;
    float offset_m_ = 0.002f;
};

/// A place on a surface that receives light.
struct SurfacePoint {
    Vec3f position = Vec3f::Zero();
    Vec3f normal = Vec3f(0, 0, 1);
    float footprint_m = 0.0f;  ///< deviation, per axis of the surface, of what one value averages
};

}  // namespace vitrine
