// render/caustic_maps.h: caustic photons made ready for look-up.
#pragma once

#include "math/sampling.h"
#include "render/photon_grid.h"

namespace vitrine {

/// Gather radius of pass k = 0, 1, ... of a progressive picture whose first pass has `first_m`
/// (Knaus and Zwicker 2011, "Progressive photon mapping: a probabilistic approach", eq. 20): the
/// passes' mean loses both its blur and its noise as their number grows.
double progressive_radius(double first_m, int pass);

/// A patch of a caustic that scatters light on (Keller 1997, "Instant radiosity").
struct SecondaryLight {
    Vec3f position = Vec3f::Zero();
    Vec3f normal = Vec3f::Zero();
    Rgb flux = Rgb::Zero();  ///< reflected diffusely, W
    std::uint8_t views = 3;
};

/// Photons made ready for look-up: sharp ones with the radius asked for, soft ones (glossy lobes)
/// with four times that. Light that a caustic scatters on to other surfaces comes from `secondary`
/// lights when these are farther than `near_m`, and nearer by from paths that find the `wide` map:
/// paths alone would meet a small bright spot too seldom, and lights too near are too bright. What
/// reaches it by way of glass or mirrors is left to paths that find the `broad` map, in which the
/// spot is 32 times the radius asked for: seldom met, it must not be bright.
struct CausticMaps {
    PhotonGrid sharp;
    PhotonGrid soft;
    PhotonGrid wide;
    PhotonGrid broad;
    std::vector<SecondaryLight> secondary;
    DiscreteDistribution secondary_choice;
    float near_m = 0.0f;
    bool empty() const { return sharp.empty() && soft.empty(); }
};
CausticMaps build_caustic_maps(const std::vector<Photon>& photons, double gather_radius_m);

}  // namespace vitrine
