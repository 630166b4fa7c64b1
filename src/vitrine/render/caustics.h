// render/caustics.h: light that reaches a surface by way of glass, metal or mirrors, as photons.
//
// Paths light -> (smooth or glossy)+ -> receiver. Every light sends a set of quasi-random rays
// towards each part that can bend them; a ray counts only if that part is the first it meets, so
// that the sets partition the paths and no power is counted twice or lost. Sets are keyed by
// (seed, light, part), so that a small change of a scene gives a small change of the photons.
// Paths that never meet a virtual part are shared by the scene with and the one without.
#pragma once

#include "base/progress.h"
#include "render/guided_choice.h"
#include "render/photon_grid.h"
#include "render/render_scene.h"

namespace vitrine {

struct CausticOptions {
    std::uint64_t photon_count = 2'000'000;  ///< rays shot, over all lights and parts
    double gather_radius_m = 0.0015;         ///< about a pixel; blurs the caustic by half of it
    int max_interfaces = 24;                 ///< bounces within glass before a photon is given up
    int pass = 0;  ///< which stretch of `photon_count` rays of the endless sequence to shoot
    std::uint64_t seed = 0;
};

/// Gather radius of pass k = 0, 1, ... of a progressive picture whose first pass has `first_m`
/// (Knaus and Zwicker 2011, "Progressive photon mapping: a probabilistic approach", eq. 20): the
/// passes' mean loses both its blur and its noise as their number grows.
double progressive_radius(double first_m, int pass);

/// Where the power went, in W over the three channels: emitted = stored + escaped + absorbed +
/// ended + chance, up to rounding.
struct PhotonBalance {
    double emitted = 0;   ///< of rays that met their part first
    double stored = 0;    ///< arrivals at the first receiver of each path
    double escaped = 0;   ///< left the scene
    double absorbed = 0;  ///< in glass, at mirrors and by reflectances below one
    double ended = 0;     ///< given up after max_interfaces
    double chance = 0;    ///< removed less added by Russian roulette; zero on average
    std::uint64_t shot = 0, met = 0;
    PhotonBalance& operator+=(const PhotonBalance& other);
};

/// The photons, in input order: bit-identical for any number of threads.
struct CausticPhotons {
    std::vector<Photon> photons;
    PhotonBalance balance;  ///< of the scene with all parts
};
CausticPhotons trace_caustics(const RenderScene& scene, const CausticOptions& options,
                              const Progress& progress = {});

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
    GuidedChoice secondary_choice;
    float near_m = 0.0f;
    bool empty() const { return sharp.empty() && soft.empty(); }
};
CausticMaps build_caustic_maps(const std::vector<Photon>& photons, double gather_radius_m);

}  // namespace vitrine
