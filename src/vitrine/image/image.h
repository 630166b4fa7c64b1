// image/image.h: a rectangle of pixels. Pixel centres sit at integer coordinates; row 0 is on top.
#pragma once

#include "base/error.h"
#include "math/vector.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace vitrine {

/// Zero of a pixel type; Eigen's default constructor leaves its numbers undefined.
template <typename T>
T zero_pixel() {
    if constexpr (requires { T::Zero(); }) {
        return T::Zero();
    } else {
        return T{};
    }
}

template <typename T>
class Image {
  public:
    Image() = default;
    Image(int width, int height, const T& fill = zero_pixel<T>())
        : width_(width),
          height_(height),
          pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), fill) {}

    int width() const { return width_; }
    int height() const { return height_; }
    std::size_t size() const { return pixels_.size(); }
    bool empty() const { return pixels_.empty(); }
    bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }
    template <typename U>
    bool same_size(const Image<U>& other) const {
        return width_ == other.width() && height_ == other.height();
    }

    T& operator()(int x, int y) { return pixels_[index(x, y)]; }
    const T& operator()(int x, int y) const { return pixels_[index(x, y)]; }
    T& operator[](std::size_t i) { return pixels_[i]; }
    const T& operator[](std::size_t i) const { return pixels_[i]; }
    /// The pixel nearest to (x, y) inside the image.
    const T& clamped(int x, int y) const {
        return (*this)(std::clamp(x, 0, width_ - 1), std::clamp(y, 0, height_ - 1));
    }

    T* data() { return pixels_.data(); }
    const T* data() const { return pixels_.data(); }
    auto begin() { return pixels_.begin(); }
    auto end() { return pixels_.end(); }
    auto begin() const { return pixels_.begin(); }
    auto end() const { return pixels_.end(); }

  private:
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
               static_cast<std::size_t>(x);
    }

    int width_ = 0;
    int height_ = 0;
    std::vector<T> pixels_;
};

using ImageRgb = Image<Rgb>;  ///< linear Rec. 709
using ImageF = Image<float>;
using Mask = Image<std::uint8_t>;  ///< 0 outside, 255 inside
using Rgb8 = Eigen::Array<std::uint8_t, 3, 1>;
using ImageRgb8 = Image<Rgb8>;  ///< sRGB encoded

inline bool is_inside(const Mask& mask, int x, int y) {
    return mask.contains(x, y) && mask(x, y) > 127;
}

/// Bilinear look-up at real-valued pixel coordinates, clamped at the borders.
template <typename T>
T bilinear(const Image<T>& image, double x, double y) {
    const double cx = std::clamp(x, 0.0, static_cast<double>(image.width() - 1));
    const double cy = std::clamp(y, 0.0, static_cast<double>(image.height() - 1));
    const int x0 = std::min(static_cast<int>(cx), std::max(0, image.width() - 2));
    const int y0 = std::min(static_cast<int>(cy), std::max(0, image.height() - 2));
    const float tx = static_cast<float>(cx - x0), ty = static_cast<float>(cy - y0);
    return (image(x0, y0) * (1 - tx) + image.clamped(x0 + 1, y0) * tx) * (1 - ty) +
           (image.clamped(x0, y0 + 1) * (1 - tx) + image.clamped(x0 + 1, y0 + 1) * tx) * ty;
}

}  // namespace vitrine
