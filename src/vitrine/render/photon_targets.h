// render/photon_targets.h: what a light's photons are aimed at.
#pragma once

#include "render/caustics.h"

namespace vitrine {

/// A part that bends light, seen from one light: a set of photons.
struct PhotonTarget {
    std::size_t light = 0;
    int part = 0;
    Sphere sphere;
    std::uint64_t count = 0;  ///< of a pass
    std::uint64_t key = 0;    ///< of the random numbers
};

/// All pairs of a light and a part that bends it, with their shares of `options.photon_count`.
std::vector<PhotonTarget> find_targets(const RenderScene& scene, const CausticOptions& options);

}  // namespace vitrine
