#include "image/colour.h"
#include "image/filter.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(Colour, SrgbRoundTripOverAllCodes) {
    for (int code = 0; code < 256; ++code) {
        EXPECT_EQ(std::lround(linear_to_srgb(srgb_to_linear(code / 255.0f)) * 255), code);
    }
    EXPECT_NEAR(srgb_to_linear(0.5f), 0.214041f, 1e-6f);
}

TEST(Colour, LabOfWhiteAndGrey) {
    const Vec3f white = lab_from_linear(Rgb(1, 1, 1));
    EXPECT_NEAR(white.x(), 100.0f, 1e-3f);
    EXPECT_NEAR(white.tail<2>().norm(), 0.0f, 0.02f);
    EXPECT_NEAR(lab_from_linear(Rgb::Constant(0.18418652f)).x(), 50.0f, 0.01f);
}

TEST(Filter, BlurKeepsTheSumAndWidens) {
    ImageF image(41, 41, 0.0f);
    image(20, 20) = 1.0f;
    const ImageF blurred = gaussian_blur(image, 2.0);
    double sum = 0, second = 0;
    for (int y = 0; y < 41; ++y) {
        for (int x = 0; x < 41; ++x) {
            sum += blurred(x, y);
            second += blurred(x, y) * (x - 20) * (x - 20);
        }
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_NEAR(std::sqrt(second), 2.0, 0.05);
}

TEST(Filter, DistanceMatchesBruteForce) {
    Mask mask(23, 17, 0);
    for (const auto& [x, y] : {std::pair{3, 4}, {20, 2}, {11, 15}}) mask(x, y) = 255;
    const ImageF distance = distance_to(mask);
    for (int y = 0; y < 17; ++y) {
        for (int x = 0; x < 23; ++x) {
            double best = 1e9;
            for (int v = 0; v < 17; ++v) {
                for (int u = 0; u < 23; ++u) {
                    if (mask(u, v)) best = std::min(best, std::hypot(u - x, v - y));
                }
            }
            EXPECT_NEAR(distance(x, y), best, 1e-4);
        }
    }
    EXPECT_GE(distance_to(Mask(4, 4, 0))(1, 1), 1e8f);
}

TEST(Filter, MorphologyAndOverlap) {
    Mask mask(9, 9, 0);
    mask(4, 4) = 255;
    EXPECT_EQ(count_inside(dilate(mask, 2)), 25u);
    EXPECT_EQ(count_inside(erode(dilate(mask, 2), 2)), 1u);
    EXPECT_DOUBLE_EQ(intersection_over_union(mask, dilate(mask, 1)), 1.0 / 9.0);
    EXPECT_FLOAT_EQ(signed_distance(mask)(4, 4), -0.5f);
    EXPECT_FLOAT_EQ(signed_distance(mask)(5, 4), 0.5f);
}

TEST(Image, BilinearAtBordersAndBetween) {
    ImageF image(2, 2);
    image(0, 0) = 0;
    image(1, 0) = 1;
    image(0, 1) = 2;
    image(1, 1) = 3;
    EXPECT_FLOAT_EQ(bilinear(image, 0.5, 0.5), 1.5f);
    EXPECT_FLOAT_EQ(bilinear(image, -3, 9), 2.0f);
}

}  // namespace
}  // namespace vitrine
