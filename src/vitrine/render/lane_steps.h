// render/lane_steps.h: inner steps of loops over lanes, in the order in which Eigen does them, so
// that lanes have the bits of single points.
#pragma once

#include <cmath>

namespace vitrine {

inline float dot(float ax, float ay, float az, float bx, float by, float bz) {
    return ax * bx + (ay * by + az * bz);
}

/// Tangent and bitangent of `Frame`, of math/rigid3.h.
struct Tangents {
    float tx, ty, tz, bx, by, bz;
};
inline Tangents tangents(float nx, float ny, float nz) {
    const float sign = std::copysign(1.0f, nz);
    const float a = -1.0f / (sign + nz);
    const float b = nx * ny * a;
    return {1.0f + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny};
}

}  // namespace vitrine
