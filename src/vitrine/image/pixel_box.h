// image/pixel_box.h: rectangles of pixels, to work on no more of a picture than counts.
#pragma once

#include "image/image.h"

namespace vitrine {

/// A rectangle of pixels, half open.
struct PixelBox {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    int width() const { return x1 - x0; }
    int height() const { return y1 - y0; }
    bool is_empty() const { return x1 <= x0 || y1 <= y0; }
    void extend(int x, int y);
    /// By so many pixels on each side, within a picture of that size.
    PixelBox grown(int by, int width, int height) const;
    /// The smallest one with the inside of `mask`.
    static PixelBox of(const Mask& mask);
};

template <typename T>
Image<T> crop(const Image<T>& image, const PixelBox& box) {
    Image<T> result(box.width(), box.height());
    for (int y = 0; y < box.height(); ++y)
        for (int x = 0; x < box.width(); ++x) result(x, y) = image(box.x0 + x, box.y0 + y);
    return result;
}

}  // namespace vitrine
