#include "render/soft_light.h"

#include "base/parallel.h"

namespace vitrine {
namespace {

constexpr float kSigmaOfDistance = 0.1f;
/// Neighbours count up to this angle between normals (cosine), and this far off the plane.
constexpr float kMinNormalCos = 0.9f;
constexpr float kMaxHeightOfSigma = 1.0f;
constexpr int kLevels = 5;  // steps of 1, 2, 4, 8, 16 pixels
/// By which the variance of a level's mean exceeds that of independent pixels: an area of variance
/// V holds 4 pi V of these.
constexpr float kLevelCorrelation = 3.2f;
constexpr float kSpline[3] = {6.0f / 16, 4.0f / 16, 1.0f / 16};

bool is_seen(const SoftPixel& pixel) {
    return pixel.normal.z() != 0 || pixel.normal.x() != 0 || pixel.normal.y() != 0;
}

float facing(const SoftPixel& a, const SoftPixel& b) {
    const float t = (a.normal.dot(b.normal) - kMinNormalCos) / (1 - kMinNormalCos);
    return t > 0 ? t * t : 0.0f;
}

/// Standard deviation of the mean's area around each pixel.
struct Reach {
    float sigma_m = 0;
    float variance_px2 = 0;
};

Reach reach_of(const Image<SoftPixel>& pixels, const Camera& camera, const Vec3f& eye, int x,
               int y) {
    const SoftPixel& pixel = pixels(x, y);
    float inverse = 0, hits = 0;
    for (int dy = -4; dy <= 4; dy += 2) {
        for (int dx = -4; dx <= 4; dx += 2) {
            if (!pixels.contains(x + dx, y + dy)) continue;
            const SoftPixel& other = pixels(x + dx, y + dy);
            if (!is_seen(other) || facing(pixel, other) <= 0) continue;
            inverse += other.inverse_square_sum;
            hits += static_cast<float>(other.hits);
        }
    }
    const Vec3f to_eye = eye - pixel.position;
    const float distance = to_eye.norm();
    Reach reach;
    reach.sigma_m = hits > 0 ? kSigmaOfDistance * std::sqrt(hits / inverse) : distance;
    const float cos_view = std::max(0.1f, std::abs(pixel.normal.dot(to_eye)) / distance);
    const float sigma_px = reach.sigma_m * static_cast<float>(camera.fx) * cos_view / distance;
    reach.variance_px2 = sigma_px * sigma_px;
    return reach;
}

/// Paths that the neighbour at (dx, dy) counts for: no more than the one opposite of it has. Pixels
/// where more light changes get more paths, and would pull the mean towards themselves.
float balanced_weight(const Image<SoftPixel>& pixels, int x, int y, int dx, int dy) {
    const float weight = pixels(x + dx, y + dy).value.weight;
    if (!pixels.contains(x - dx, y - dy)) return weight;
    const float opposite = pixels(x - dx, y - dy).value.weight;
    return opposite > 0 ? std::min(weight, opposite) : weight;
}

/// One level: a mean of 5 x 5 pixels `step` apart, mixed with the pixel itself so that the area's
/// variance grows by no more than `variance_px2`.
SoftValue mean_around(const Image<SoftPixel>& pixels, int x, int y, int step, const Reach& reach,
                      float variance_px2) {
    const SoftPixel& pixel = pixels(x, y);
    const float share = std::min(1.0f, variance_px2 / static_cast<float>(step * step));
    const bool is_empty = pixel.value.weight <= 0;
    if (share <= 0 && !is_empty) return pixel.value;
    SoftValue mean;
    float sum = 0, kernel_sum = 0, variance_sum = 0;
    const float max_height = kMaxHeightOfSigma * reach.sigma_m;
    for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i) {
            const int u = x + i * step, v = y + j * step;
            if (!pixels.contains(u, v)) continue;
            const SoftPixel& other = pixels(u, v);
            if (other.value.weight <= 0) continue;
            float kernel = (is_empty ? 1.0f : share) * kSpline[std::abs(i)] * kSpline[std::abs(j)];
            if (i == 0 && j == 0) {
                kernel += 1 - share;
            } else {
                if (std::abs((other.position - pixel.position).dot(pixel.normal)) > max_height) {
                    continue;
                }
                kernel *= facing(pixel, other);
                if (kernel <= 0) continue;
            }
            const float w = kernel * balanced_weight(pixels, x, y, i * step, j * step);
            mean.with += w * other.value.with;
            mean.shadow += w * other.value.shadow;
            mean.diffuse += w * other.value.diffuse;
            mean.variance += w * w * other.value.variance;
            variance_sum += w * other.value.variance;
            sum += w;
            kernel_sum += kernel;
        }
    }
    if (sum <= 0) return pixel.value;
    mean.with /= sum;
    mean.shadow /= sum;
    mean.diffuse /= sum;
    // What the levels before have mixed is no longer independent.
    const float correlation = step > 1 ? kLevelCorrelation : 1.0f;
    mean.variance = std::min(variance_sum / sum, correlation * mean.variance / (sum * sum));
    mean.weight = sum / kernel_sum;
    return mean;
}

}  // namespace

void average_soft_light(Image<SoftPixel>& pixels, const Camera& camera) {
    const int width = pixels.width();
    const Vec3f eye = camera.centre_in_world().cast<float>();
    Image<Reach> reach(width, pixels.height(), Reach{});
    const auto for_seen = [&](const auto& body) {
        parallel_for(static_cast<std::size_t>(pixels.height()), 4, [&](std::size_t row) {
            for (int x = 0; x < width; ++x) {
                if (is_seen(pixels(x, static_cast<int>(row)))) body(x, static_cast<int>(row));
            }
        });
    };
    for_seen([&](int x, int y) { reach(x, y) = reach_of(pixels, camera, eye, x, y); });
    std::vector<SoftValue> next(pixels.size());
    float reached_px2 = 0;
    for (int level = 0; level < kLevels; ++level) {
        const int step = 1 << level;
        for_seen([&](int x, int y) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(x);
            next[i] = mean_around(pixels, x, y, step, reach[i],
                                  std::max(0.0f, reach[i].variance_px2 - reached_px2));
        });
        for_seen([&](int x, int y) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(x);
            pixels[i].value = next[i];
        });
        reached_px2 += static_cast<float>(step * step);
    }
}

}  // namespace vitrine
