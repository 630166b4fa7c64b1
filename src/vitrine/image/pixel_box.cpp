#include "image/pixel_box.h"

#include <algorithm>

namespace vitrine {

void PixelBox::extend(int x, int y) {
    if (is_empty()) {
        *this = {x, y, x + 1, y + 1};
        return;
    }
    x0 = std::min(x0, x), y0 = std::min(y0, y);
    x1 = std::max(x1, x + 1), y1 = std::max(y1, y + 1);
}

PixelBox PixelBox::grown(int by, int width, int height) const {
    if (is_empty()) return {};
    return {std::max(0, x0 - by), std::max(0, y0 - by), std::min(width, x1 + by),
            std::min(height, y1 + by)};
}

PixelBox PixelBox::of(const Mask& mask) {
    PixelBox box;
    for (int y = 0; y < mask.height(); ++y) {
        for (int x = 0; x < mask.width(); ++x) {
            if (mask(x, y) > 127) box.extend(x, y);
        }
    }
    return box;
}

}  // namespace vitrine
