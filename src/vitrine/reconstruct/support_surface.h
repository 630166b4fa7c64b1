// reconstruct/support_surface.h: the plane that carries the objects, as far as it was seen or is
// only hidden by what stands on it.
#pragma once

#include "geometry/mesh.h"
#include "geometry/plane.h"

namespace vitrine {

/// The cells of a regular grid on the plane that hold surface. Origin and axes lie in the plane.
struct SupportSurface {
    Rigid3 plane_from_world;  ///< z = 0 is the plane
    double cell_m = 0.0;
    int columns = 0, rows = 0;
    Vec2 origin = Vec2::Zero();           ///< corner of cell (0, 0), in the plane
    std::vector<std::uint8_t> is_filled;  ///< by row * columns + column

    bool contains(const Vec3& point_in_world) const;  ///< is the foot of the point on the surface?
    /// Two triangles a filled cell, facing up; vertices shared; no colours.
    Mesh mesh() const;
};

/// Cells within `tolerance_m` of a vertex of the scan are filled; holes, and bays up to 6 cm wide
/// (places hidden behind objects), are closed.
SupportSurface find_support_surface(const Mesh& scan, const Plane& plane, double cell_m,
                                    double tolerance_m);

}  // namespace vitrine
