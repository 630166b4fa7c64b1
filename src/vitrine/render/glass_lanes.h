// render/glass_lanes.h: photons at dielectric boundaries, many side by side. A lane's values do not
// depend on its neighbours; the rays are bit by bit those of `bend`.
#pragma once

#include "render/plain_lanes.h"

namespace vitrine {

/// The share of a photon's first power below which a ray of it is left to chance.
constexpr float kSurePower = 0.25f;

/// One of the two rays that leave a boundary.
struct BranchLanes {
    Lanes3 power;
    Lane<std::uint32_t> is_refracted;  ///< else reflected
    Lane<std::uint32_t> is_open;       ///< goes on
};

struct GlassLanes {
    // Given.
    Lane<float> eta;      ///< index beyond / index before; 1: not optical
    Lane<float> initial;  ///< power of the photon at first, of its strongest channel
    // The boundary.
    Lane<float> reflectance;  ///< unpolarised Fresnel; 0 where it is not optical
    Lanes3 reflected, refracted;
    Lane<std::uint32_t> is_odd;  ///< rounded and flat normal disagree
    // What goes on.
    BranchLanes strong, faint;
    Lane<float> chance;  ///< power that Russian roulette took, less what it gave
};

/// Fills reflectance, reflected and refracted of the surfaces that `find_surfaces` found.
void bend_lanes(const PlainLanes& surfaces, GlassLanes& glass, int count);

/// Both branches go on, the fainter with a chance that shrinks with its power, the stronger with
/// one when it carries little of the photon's `initial` power: fills strong, faint, chance.
/// @param surfaces  u decides of the faint branch, v of the strong one
void branch_lanes(const PlainLanes& surfaces, GlassLanes& glass, int count);

}  // namespace vitrine
