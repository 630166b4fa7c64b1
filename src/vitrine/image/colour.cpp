#include "image/colour.h"

#include <array>

namespace vitrine {

float srgb_to_linear(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

float linear_to_srgb(float linear) {
    const float v = std::clamp(linear, 0.0f, 1.0f);
    return v <= 0.0031308f ? v * 12.92f : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
}

ImageRgb srgb_to_linear(const ImageRgb8& encoded) {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> t{};
        for (int i = 0; i < 256; ++i) t[static_cast<std::size_t>(i)] = srgb_to_linear(i / 255.0f);
        return t;
    }();
    ImageRgb linear(encoded.width(), encoded.height());
    for (std::size_t i = 0; i < encoded.size(); ++i) {
        linear[i] = Rgb(table[encoded[i][0]], table[encoded[i][1]], table[encoded[i][2]]);
    }
    return linear;
}

ImageRgb8 linear_to_srgb8(const ImageRgb& linear, float scale) {
    ImageRgb8 encoded(linear.width(), linear.height());
    for (std::size_t i = 0; i < linear.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            encoded[i][c] = static_cast<std::uint8_t>(
                std::lround(linear_to_srgb(linear[i][c] * scale) * 255.0f));
        }
    }
    return encoded;
}

ImageF luminance_image(const ImageRgb& image) {
    ImageF result(image.width(), image.height());
    for (std::size_t i = 0; i < image.size(); ++i) result[i] = luminance(image[i]);
    return result;
}

Vec3f lab_from_linear(const Rgb& linear) {
    const auto f = [](float t) {
        return t > 216.0f / 24389.0f ? std::cbrt(t) : (24389.0f / 27.0f * t + 16.0f) / 116.0f;
    };
    const float x = 0.4123908f * linear[0] + 0.3575843f * linear[1] + 0.1804808f * linear[2];
    const float y = 0.2126390f * linear[0] + 0.7151687f * linear[1] + 0.0721923f * linear[2];
    const float z = 0.0193308f * linear[0] + 0.1191948f * linear[1] + 0.9505322f * linear[2];
    const float fx = f(x / 0.9504559f), fy = f(y), fz = f(z / 1.0890578f);
    return {116.0f * fy - 16.0f, 500.0f * (fx - fy), 200.0f * (fy - fz)};
}

float delta_e(const Rgb& a, const Rgb& b) {
    return (lab_from_linear(a) - lab_from_linear(b)).norm();
}

}  // namespace vitrine
