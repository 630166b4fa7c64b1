// render/interface.h: a ray at a dielectric boundary: which media meet, where the two rays go.
// Shared by camera paths and photons, so that both bend alike.
#pragma once

#include "render/render_scene.h"

namespace vitrine {

/// What lies beyond a dielectric part's surface.
struct Boundary {
    Media beyond;      ///< media after crossing
    float eta = 1.0f;  ///< index beyond / index before; 1: not optical
};
/// @param is_front from outside the part; @param media on this side
Boundary cross_boundary(const RenderScene& scene, int part, bool is_front, const Media& media);

/// The two rays at an optical boundary.
struct BentRays {
    float reflectance = 0.0f;  ///< unpolarised Fresnel
    Vec3f reflected = Vec3f::Zero();
    Vec3f refracted = Vec3f::Zero();  ///< meaningless when reflectance is 1
};
/// @param direction unit, of travel; @param eta index beyond / index before, not 1
BentRays bend(const ShadingPoint& point, const Vec3f& direction, float eta);

/// Mirror direction about the shading normal, kept above the geometric surface.
Vec3f mirror_direction(const ShadingPoint& point, const Vec3f& direction);

}  // namespace vitrine
