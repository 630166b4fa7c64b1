// render/packed_lanes.h: directions packed side by side, bit by bit as `PackedDirection` packs one.
#pragma once

#include "render/photon_grid.h"
#include "render/plain_lanes.h"

namespace vitrine {

struct PackedLanes {
    Lane<std::int16_t> x, y;
    PackedDirection at(int i) const {
        const auto k = static_cast<std::size_t>(i);
        PackedDirection packed;
        packed.x = x[k];
        packed.y = y[k];
        return packed;
    }
};

/// @param unit  as the first argument of PackedDirection
/// @param sign  1 or -1, by which it is multiplied
void pack_directions(const Lanes3& unit, float sign, PackedLanes& packed, int count);

}  // namespace vitrine
