#include "image/filter.h"

#include "base/parallel.h"

namespace vitrine {
namespace {

std::vector<float> gaussian_kernel(double sigma) {
    const int radius = std::max(1, static_cast<int>(std::ceil(3.0 * sigma)));
    std::vector<float> kernel(static_cast<std::size_t>(2 * radius + 1));
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) {
        const double w = std::exp(-0.5 * i * i / (sigma * sigma));
        kernel[static_cast<std::size_t>(i + radius)] = static_cast<float>(w);
        sum += w;
    }
    for (float& w : kernel) w = static_cast<float>(w / sum);
    return kernel;
}

template <typename T>
Image<T> blur(const Image<T>& image, double sigma, const T& zero) {
    if (sigma <= 0) return image;
    const std::vector<float> kernel = gaussian_kernel(sigma);
    const int radius = static_cast<int>(kernel.size() / 2);
    const int width = image.width(), height = image.height();
    if (image.size() == 0) return image;
    Image<T> rows(width, height), result(width, height, zero);
    parallel_for(static_cast<std::size_t>(height), 16, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        // Borders repeated once, so that the inner loop asks no questions.
        std::vector<T> padded(static_cast<std::size_t>(width + 2 * radius), zero);
        for (int x = -radius; x < width + radius; ++x)
            padded[static_cast<std::size_t>(x + radius)] = image.clamped(x, y);
        for (int x = 0; x < width; ++x) {
            T sum = zero;
            for (std::size_t k = 0; k < kernel.size(); ++k)
                sum += padded[static_cast<std::size_t>(x) + k] * kernel[k];
            rows(x, y) = sum;
        }
    });
    parallel_for(static_cast<std::size_t>(height), 16, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        T* const to = &result(0, y);
        for (int k = -radius; k <= radius; ++k) {
            const T* const from = &rows(0, std::clamp(y + k, 0, height - 1));
            const float weight = kernel[static_cast<std::size_t>(k + radius)];
            for (int x = 0; x < width; ++x) to[x] += from[x] * weight;
        }
    });
    return result;
}

template <bool kLargest>
Mask extreme(const Mask& mask, int radius) {
    if (radius <= 0) return mask;
    Mask rows(mask.width(), mask.height()), result(mask.width(), mask.height());
    const auto pass = [&](const Mask& from, Mask& to, int dx, int dy) {
        for (int y = 0; y < mask.height(); ++y) {
            for (int x = 0; x < mask.width(); ++x) {
                std::uint8_t best = from(x, y);
                for (int k = -radius; k <= radius; ++k) {
                    if (!from.contains(x + dx * k, y + dy * k)) continue;
                    const std::uint8_t v = from(x + dx * k, y + dy * k);
                    best = kLargest ? std::max(best, v) : std::min(best, v);
                }
                to(x, y) = best;
            }
        }
    };
    pass(mask, rows, 1, 0);
    pass(rows, result, 0, 1);
    return result;
}

constexpr float kFar = 1e18f;  // squared; its root is the 1e9 promised in the header

/// One row of the squared distance transform: lower envelope of parabolas.
void distance_row(std::vector<float>& f, std::vector<int>& v, std::vector<float>& z) {
    const int n = static_cast<int>(f.size());
    std::vector<float> out(f.size());
    int k = -1;
    for (int q = 0; q < n; ++q) {
        if (f[q] >= kFar) continue;
        float s = -INFINITY;
        while (k >= 0) {
            const int p = v[k];
            s = ((f[q] + float(q) * q) - (f[p] + float(p) * p)) / (2.0f * (q - p));
            if (s > z[k]) break;
            --k;
        }
        ++k;
        v[k] = q;
        z[k] = k == 0 ? -INFINITY : s;
    }
    if (k < 0) return;
    int j = 0;
    for (int q = 0; q < n; ++q) {
        while (j < k && z[j + 1] < q) ++j;
        out[q] = float(q - v[j]) * float(q - v[j]) + f[v[j]];
    }
    f = out;
}

}  // namespace

ImageF gaussian_blur(const ImageF& image, double sigma_px) { return blur(image, sigma_px, 0.0f); }
ImageRgb gaussian_blur(const ImageRgb& image, double sigma_px) {
    return blur(image, sigma_px, Rgb(Rgb::Zero()));
}

Mask dilate(const Mask& mask, int radius_px) { return extreme<true>(mask, radius_px); }
Mask erode(const Mask& mask, int radius_px) { return extreme<false>(mask, radius_px); }

Mask mask_or(const Mask& a, const Mask& b) {
    VITRINE_CHECK(a.same_size(b));
    Mask result = a;
    for (std::size_t i = 0; i < a.size(); ++i) result[i] = std::max(a[i], b[i]);
    return result;
}

Mask mask_not(const Mask& a) {
    Mask result = a;
    for (auto& v : result) v = v > 127 ? 0 : 255;
    return result;
}

std::size_t count_inside(const Mask& mask) {
    return static_cast<std::size_t>(
        std::count_if(mask.begin(), mask.end(), [](std::uint8_t v) { return v > 127; }));
}

double intersection_over_union(const Mask& a, const Mask& b) {
    VITRINE_CHECK(a.same_size(b));
    std::size_t both = 0, either = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        both += (a[i] > 127 && b[i] > 127) ? 1 : 0;
        either += (a[i] > 127 || b[i] > 127) ? 1 : 0;
    }
    return either == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(either);
}

ImageF distance_to(const Mask& mask) {
    ImageF squared(mask.width(), mask.height());
    for (std::size_t i = 0; i < mask.size(); ++i) squared[i] = mask[i] > 127 ? 0.0f : kFar;
    const auto length = static_cast<std::size_t>(std::max(mask.width(), mask.height()));
    std::vector<int> v(length);
    std::vector<float> z(length), line;
    line.resize(static_cast<std::size_t>(mask.height()));
    for (int x = 0; x < mask.width(); ++x) {
        for (int y = 0; y < mask.height(); ++y) line[static_cast<std::size_t>(y)] = squared(x, y);
        distance_row(line, v, z);
        for (int y = 0; y < mask.height(); ++y) squared(x, y) = line[static_cast<std::size_t>(y)];
    }
    line.resize(static_cast<std::size_t>(mask.width()));
    for (int y = 0; y < mask.height(); ++y) {
        for (int x = 0; x < mask.width(); ++x) line[static_cast<std::size_t>(x)] = squared(x, y);
        distance_row(line, v, z);
        for (int x = 0; x < mask.width(); ++x) squared(x, y) = line[static_cast<std::size_t>(x)];
    }
    for (float& d : squared) d = std::sqrt(d);
    return squared;
}

ImageF signed_distance(const Mask& mask) {
    const ImageF outside = distance_to(mask), inside = distance_to(mask_not(mask));
    ImageF result(mask.width(), mask.height());
    for (std::size_t i = 0; i < result.size(); ++i) {
        result[i] = mask[i] > 127 ? 0.5f - inside[i] : outside[i] - 0.5f;
    }
    return result;
}

ImageRgb downsample_half(const ImageRgb& image) {
    ImageRgb half(image.width() / 2, image.height() / 2);
    for (int y = 0; y < half.height(); ++y) {
        for (int x = 0; x < half.width(); ++x) {
            half(x, y) = 0.25f * (image(2 * x, 2 * y) + image(2 * x + 1, 2 * y) +
                                  image(2 * x, 2 * y + 1) + image(2 * x + 1, 2 * y + 1));
        }
    }
    return half;
}

}  // namespace vitrine
