// estimate/vessel.h: hollow glass made of a hull and a wall thickness, and rays through it.
#pragma once

#include "geometry/mesh.h"
#include "render/estimation_refraction.h"
#include "trace/accel.h"

namespace vitrine {

/// Outer surface and an inner one `wall_m` further in, facing the cavity: a thin-walled vessel.
Mesh shell_of(const Mesh& hull, double wall_m);

/// A vessel of one wall thickness, ready for rays.
class Vessel {
  public:
    Vessel(const Mesh& hull, double wall_m);

    /// The way of a ray through all walls: refracted at each surface, totally reflected where Snell
    /// asks. `length_m` counts glass only. Not valid when the ray misses or is never let out.
    /// Costs about four closest hits.
    RefractedPath pass(const Vec3f& origin, const Vec3f& direction, float ior) const;

  private:
    std::shared_ptr<const Mesh> mesh_;
    Accel accel_;
};

}  // namespace vitrine
