// render/caustics.h: light that reaches a surface by way of glass, metal or mirrors, as photons.
//
// Paths light -> (smooth or glossy)+ -> receiver. Every light sends a set of quasi-random rays
// towards each part that can bend them; a ray counts only if that part is the first it meets, so
// that the sets partition the paths and no power is counted twice or lost. Sets are keyed by
// (seed, light, part), so that a small change of a scene gives a small change of the photons.
// Paths that never meet a virtual part are shared by the scene with and the one without.
#pragma once

#include "base/progress.h"
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

}  // namespace vitrine
