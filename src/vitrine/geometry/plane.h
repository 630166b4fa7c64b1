// geometry/plane.h: planes and how to find them in points.
#pragma once

#include "math/rigid3.h"

#include <cstdint>
#include <span>
#include <vector>

namespace vitrine {

/// All x with normal . x = offset_m; the normal is unit.
struct Plane {
    Vec3 normal = Vec3::UnitZ();
    double offset_m = 0.0;

    double height(const Vec3& p) const { return normal.dot(p) - offset_m; }  ///< signed, metres
    Vec3 project(const Vec3& p) const { return p - height(p) * normal; }
};

/// Rotation and shift that turn the plane into z = 0 with its normal along +z.
Rigid3 plane_from_world(const Plane& plane);

struct PlaneFit {
    Plane plane;
    std::size_t inliers = 0;
    double rms_m = 0.0;  ///< of the inliers
};

/// Plane through most of the points within `tolerance_m` (RANSAC with a fixed seed, then least
/// squares with Tukey weights on the inliers). The sign of the normal is arbitrary.
/// Cost: `trials` passes over at most 5000 of the points. No inliers when fewer than three points.
PlaneFit fit_plane(std::span<const Vec3> points, double tolerance_m, int trials = 400,
                   std::uint64_t seed = 1);

}  // namespace vitrine
