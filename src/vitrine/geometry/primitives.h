// geometry/primitives.h: closed meshes of simple bodies, for tests, synthetic worlds and presets.
#pragma once

#include "geometry/mesh.h"

namespace vitrine {

Mesh make_box(const Vec3& size_m, const Vec3& centre = Vec3::Zero());
/// `rings` from pole to pole and 2 * rings around; smooth normals.
Mesh make_sphere(double radius_m, const Vec3& centre, int rings = 48);
Mesh make_torus(double major_radius_m, double minor_radius_m, const Vec3& centre, int segments = 96,
                int sides = 48);
/// Body of revolution about z from a profile (radius, z) listed from bottom to top; ends on the
/// axis are closed by caps. Creases sharper than 40 degrees stay sharp.
Mesh make_lathe(const std::vector<Vec2>& profile_m, int segments = 96);
Mesh make_cylinder(double radius_m, double height_m, const Vec3& base_centre, int segments = 96);
/// Square of side `size_m` at height z, facing +z, uv over [0, 1]^2.
Mesh make_plane(double size_m, double z = 0, int cells = 1);

}  // namespace vitrine
