// render/photon_emission.h: photons as they leave a light, many side by side, and in which order.
#pragma once

#include "render/photon_targets.h"
#include "render/plain_lanes.h"

#include <optional>
#include <span>
#include <vector>

namespace vitrine {

/// Photons that leave a light.
struct EmittedLanes {
    Lanes3 origin, direction;
    Lanes3 power;  ///< W of a photon
};

/// The photons of a target; values are bit by bit those of `LightSampler::emit`.
class PhotonEmission {
  public:
    PhotonEmission(const RenderScene& scene, const PhotonTarget& target);

    /// The photons `indices`, kLanes at most.
    void emit(std::span<const std::uint32_t> indices, EmittedLanes& photons) const;

  private:
    const RenderScene& scene_;
    const PhotonTarget& target_;
    std::optional<LaneLight> light_;  // empty: of another kind than disc and point
};

/// The photons [first, first + count) of a target, those sent in nearly the same direction one
/// after the other: rays that run beside their neighbours share the work of finding what they meet.
std::vector<std::uint32_t> coherent_order(const PhotonTarget& target, std::uint64_t first,
                                          std::uint64_t count);

}  // namespace vitrine
