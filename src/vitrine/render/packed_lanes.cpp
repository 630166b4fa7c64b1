#include "render/packed_lanes.h"

#include "base/wide.h"

#include <cmath>

namespace vitrine {
namespace {

inline std::int32_t to_steps(float v) {
    const float low = v < -1.0f ? -1.0f : v;
    const float scaled = (low > 1.0f ? 1.0f : low) * 32767.0f;
    return static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5f : scaled + 0.5f);
}

inline float sign_not_zero(float v) { return v < 0 ? -1.0f : 1.0f; }

}  // namespace

VITRINE_WIDE void pack_directions(const Lanes3& unit, float sign, PackedLanes& packed, int count) {
    const int n = whole_steps(count);
    Lane<std::int32_t> steps_x, steps_y;
    for (int i = 0; i < n; ++i) {
        const float x = sign * unit.x[i], y = sign * unit.y[i], z = sign * unit.z[i];
        const float sum = std::abs(x) + (std::abs(y) + std::abs(z));
        const float upper_x = x / sum, upper_y = y / sum;
        const float lower_x = (1 - std::abs(upper_y)) * sign_not_zero(upper_x);
        const float lower_y = (1 - std::abs(upper_x)) * sign_not_zero(upper_y);
        steps_x[i] = to_steps(z < 0 ? lower_x : upper_x);
        steps_y[i] = to_steps(z < 0 ? lower_y : upper_y);
    }
    for (int i = 0; i < n; ++i) packed.x[i] = static_cast<std::int16_t>(steps_x[i]);
    for (int i = 0; i < n; ++i) packed.y[i] = static_cast<std::int16_t>(steps_y[i]);
}

}  // namespace vitrine
