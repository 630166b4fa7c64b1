#include "image/poisson.h"

#include "base/parallel.h"
#include "image/filter.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

Mask ellipse(int size, double a, double b) {
    Mask mask(size, size);
    const double centre = 0.5 * (size - 1);
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double u = (x - centre) / a, v = (y - centre) / b;
            if (u * u + v * v < 1) mask(x, y) = 255;
        }
    }
    return mask;
}

TEST(Poisson, InflatedEllipseIsAnEllipsoid) {
    const int size = 301;
    const double a = 130, b = 80;
    const Mask mask = ellipse(size, a, b);
    const ImageF u = inflate(mask);
    float highest = 0;
    for (const float value : u) highest = std::max(highest, value);
    EXPECT_NEAR(highest, 1 / (2 / (a * a) + 2 / (b * b)), 0.02 * highest);
    double worst = 0;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double p = (x - 150) / a, q = (y - 150) / b;
            if (p * p + q * q > 0.9) continue;
            worst = std::max(worst,
                             std::abs(std::sqrt(u(x, y) / highest) - std::sqrt(1 - p * p - q * q)));
        }
    }
    EXPECT_LT(worst, 0.02);
}

TEST(Poisson, SolvesTheDiscreteEquation) {
    Mask mask = ellipse(90, 40, 30);
    ImageF known(90, 90), source(90, 90);
    for (std::size_t i = 0; i < known.size(); ++i) {
        known[i] = static_cast<float>(i % 7);
        source[i] = static_cast<float>(i % 5) - 2;
    }
    const ImageF u = solve_poisson(mask, known, source);
    for (int y = 1; y < 89; ++y) {
        for (int x = 1; x < 89; ++x) {
            if (!is_inside(mask, x, y)) {
                EXPECT_EQ(u(x, y), known(x, y));
            } else {
                const float flow =
                    4 * u(x, y) - u(x - 1, y) - u(x + 1, y) - u(x, y - 1) - u(x, y + 1);
                EXPECT_NEAR(flow, source(x, y), 2e-2);
            }
        }
    }
}

TEST(Poisson, HarmonicFillRestoresAPlane) {
    ImageRgb image(80, 60);
    for (int y = 0; y < 60; ++y)
        for (int x = 0; x < 80; ++x) image(x, y) = Rgb(0.01f * x, 0.02f * y, 1.0f);
    Mask hole(80, 60);
    ImageRgb damaged = image;
    for (int y = 20; y < 40; ++y) {
        for (int x = 10; x < 70; ++x) {
            hole(x, y) = 255;
            damaged(x, y) = Rgb::Constant(9);
        }
    }
    const ImageRgb filled = harmonic_fill(damaged, hole);
    for (std::size_t i = 0; i < image.size(); ++i)
        EXPECT_LT((filled[i] - image[i]).abs().maxCoeff(), 2e-3f);
}

TEST(Poisson, FullMaskAndEmptyMask) {
    const ImageF u = inflate(Mask(40, 40, 255));
    EXPECT_GT(u(20, 20), u(0, 0));
    for (const float value : inflate(Mask(10, 10))) EXPECT_EQ(value, 0);
}

TEST(Poisson, SameBitsOnAnyThreadCount) {
    const Mask mask = ellipse(256, 120, 90);
    set_thread_count(1);
    const ImageF one = inflate(mask);
    set_thread_count(0);
    const ImageF all = inflate(mask);
    EXPECT_TRUE(std::equal(one.begin(), one.end(), all.begin()));
}

TEST(Poisson, ExtendNearestTakesTheNearest) {
    const Mask mask = ellipse(64, 20, 12);
    ImageF image(64, 64);
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<float>(i);
    const ImageF extended = extend_nearest(image, mask);
    const ImageF distance = distance_to(mask);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const int source = static_cast<int>(extended(x, y));
            EXPECT_NEAR(std::hypot(source % 64 - x, source / 64 - y), distance(x, y), 1e-3);
        }
    }
}

}  // namespace
}  // namespace vitrine
