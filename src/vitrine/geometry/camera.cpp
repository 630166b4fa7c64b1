#include "geometry/camera.h"

#include <cmath>

namespace vitrine {

Camera Camera::scaled(double factor) const {
    Camera result = *this;
    result.width = static_cast<int>(std::lround(width * factor));
    result.height = static_cast<int>(std::lround(height * factor));
    result.fx *= factor;
    result.fy *= factor;
    // Centres at integers: the left border -0.5 stays the left border.
    result.cx = (cx + 0.5) * factor - 0.5;
    result.cy = (cy + 0.5) * factor - 0.5;
    return result;
}

}  // namespace vitrine
