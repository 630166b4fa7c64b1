#include "optics/curved_body.h"

namespace vitrine {

CurvedBodyFactor curved_body_factor(double albedo) {
    const double l = std::log(1.8 / std::clamp(albedo, 0.02, 0.95));
    const double excess = std::max(0.0, l - 0.95);
    return {1.6 * l, 3.5 * excess * excess};
}

}  // namespace vitrine
