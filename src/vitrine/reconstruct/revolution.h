// reconstruct/revolution.h: bodies of revolution. When an object has an axis, every view is a view
// from all sides: the parts that no camera faced are known, and noise averages out.
#pragma once

#include "reconstruct/candidates.h"
#include "reconstruct/visual_hull.h"

namespace vitrine {

/// phi over the half plane (radius, height): negative inside. Height 0 is the support plane.
struct ProfileField {
    double spacing_m = 0.0;
    int radii = 0, heights = 0;  ///< nodes; radius 0 is the axis
    double base_m = 0.0;         ///< height of the first row
    std::vector<float> values;   ///< by height * radii + radius

    float& at(int r, int h) { return values[static_cast<std::size_t>(h * radii + r)]; }
    float at(int r, int h) const { return values[static_cast<std::size_t>(h * radii + r)]; }
    float sample(double radius_m, double height_m) const;  ///< bilinear, clamped
};

/// Carves the half plane around an axis normal to the support plane through `foot`: per view the
/// largest outline distance around the circle, of these a soft largest, which lets the views that
/// nearly agree average their noise. Cost: about 0.6 us a node and view.
ProfileField carve_profile(std::span<const OutlineView> views, const Plane& support,
                           const Vec3& foot, double max_radius_m, double max_height_m,
                           double spacing_m, int angles = 64);

/// Foot of the axis on the support plane: where the carved volume is largest, since a wrong axis
/// lets opposite outlines cut into each other. Starts at `start`, searches within 8 mm.
Vec3 find_axis_foot(std::span<const OutlineView> views, const Plane& support, const Vec3& start,
                    double max_radius_m, double max_height_m);

/// No silhouette touches a pole that is flatter than the lowest camera is high: there the hull is a
/// cone. It becomes a ball's cap where the cone leaves the outline smoothly, a flat end where it
/// leaves from a rim; the underside is rounded in the same way unless it stands on a rim.
void complete_poles(ProfileField& profile);

/// The field in space, on the nodes of `like`.
ScalarGrid revolve(const ProfileField& profile, const Plane& support, const Vec3& foot,
                   const ScalarGrid& like);

}  // namespace vitrine
