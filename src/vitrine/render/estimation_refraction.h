// render/estimation_refraction.h: one ray through one clear object, for trial indices.
#pragma once

#include "render/estimation_scene.h"

namespace vitrine {

/// One way of a ray through a solid dielectric: refracted in, totally reflected as often as Snell
/// asks, refracted out; or the weaker way that is first reflected inside where it could have left.
/// A body met again before the scan, as a ring's far side, is passed again.
struct RefractedPath {
    bool is_valid = false;        ///< entered and left again
    Vec3f entry = Vec3f::Zero();  ///< the first
    Vec3f entry_normal = Vec3f::Zero();
    float entry_reflectance = 0.0f;
    Vec3f exit = Vec3f::Zero();
    Vec3f exit_direction = Vec3f::Zero();
    float transmittance = 0.0f;  ///< product of Fresnel transmittances, no absorption
    float length_m = 0.0f;       ///< inside, for exp(-sigma_a length)
    int internal_reflections = 0;
};

constexpr int kMaxInternalReflections = 6;

/// Where a ray from outside meets an object: the same for every trial index.
struct ObjectEntry {
    bool is_hit = false;
    bool is_valid = false;  ///< met from outside, by the facet and by the smooth normal
    Vec3f point = Vec3f::Zero();
    Vec3f normal = Vec3f::Zero();     ///< shading, outward
    Vec3f direction = Vec3f::Zero();  ///< of travel, unit
};
/// Other parts are not looked at.
ObjectEntry enter_object(const EstimationScene& scene, int object, const Vec3f& origin,
                         const Vec3f& direction);
/// What follows behind the entry, for one index; `skipped_exits` as in `refract_through`.
RefractedPath refract_from(const EstimationScene& scene, int object, const ObjectEntry& entry,
                           float ior, int skipped_exits = 0);

/// Traces `direction` (unit) from `origin` outside of `object`; other parts are not looked at.
/// @param skipped_exits 0: leaves at the first chance (the strongest way, over 90 % of the light);
///   1: is reflected there and leaves at the second (4 % at normal incidence, more at grazing)
RefractedPath refract_through(const EstimationScene& scene, int object, const Vec3f& origin,
                              const Vec3f& direction, float ior, int skipped_exits = 0);

/// The way straight through a thin-walled vessel: no bending, a slab's loss at each wall.
/// @param wall_m thickness of each wall, for the length inside the glass
RefractedPath pass_through_shell(const EstimationScene& scene, int object, const Vec3f& origin,
                                 const Vec3f& direction, float ior, float wall_m);

/// First hit of the scan from an exit point. The search starts `back_m` before it: a hull that
/// stands on a rough table may end a little below it.
Hit scan_behind(const EstimationScene& scene, const RefractedPath& path, float back_m);

}  // namespace vitrine
