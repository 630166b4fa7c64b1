#include "render/soft_light.h"

#include "base/rng.h"
#include "math/rigid3.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

constexpr int kWidth = 192, kHeight = 144;

/// A camera one metre above a plane, a millimetre a pixel.
Camera camera_above() {
    Camera camera{"0", kWidth, kHeight, 1000, 1000, 0.5 * kWidth, 0.5 * kHeight, {}};
    camera.cam_from_world = look_at(Vec3(0, 0, 1), Vec3::Zero(), Vec3(0, 1, 0)).inverse();
    return camera;
}

/// @param value(x, y) of each pixel; paths met something `hit_m` away
template <typename Value>
Image<SoftPixel> plane(float hit_m, const Value& value) {
    Image<SoftPixel> pixels(kWidth, kHeight, SoftPixel{});
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            SoftPixel& pixel = pixels(x, y);
            pixel.position = 1e-3f * Vec3f(static_cast<float>(x), static_cast<float>(y), 0) -
                             1e-3f * Vec3f(0.5f * kWidth, 0.5f * kHeight, 0);
            pixel.normal = Vec3f(0, 0, 1);
            pixel.value.with = Rgb::Constant(value(x, y));
            pixel.value.variance = 1;
            pixel.value.weight = 2;
            pixel.inverse_square_sum = 2 / (hit_m * hit_m);
            pixel.hits = 2;
        }
    }
    return pixels;
}

TEST(SoftLight, SlopesStayAndNoiseGoesByWhatIsPromised) {
    Rng rng(3);
    const auto slope = [](int x, int y) { return 1.0f + 0.01f * float(x) - 0.02f * float(y); };
    Image<SoftPixel> pixels =
        plane(0.022f, [&](int x, int y) { return slope(x, y) + 2 * (rng.next_float() - 0.5f); });
    average_soft_light(pixels, camera_above());
    double square = 0, promised = 0, mean = 0;
    int count = 0;
    for (int y = 24; y < kHeight - 24; ++y) {
        for (int x = 24; x < kWidth - 24; ++x) {
            const double error = pixels(x, y).value.with[0] - slope(x, y);
            mean += error;
            square += error * error;
            promised += pixels(x, y).value.variance / 3;  // of the noise that was put on
            ++count;
        }
    }
    EXPECT_NEAR(mean / count, 0, 0.02);
    EXPECT_LT(square / count, 1.0 / 3 / 40);
    EXPECT_NEAR(promised / square, 1, 0.5);  // few independent patches
}

TEST(SoftLight, PixelsWithMorePathsDoNotPullTheMean) {
    const auto slope = [](int x, int) { return 1.0f + 0.05f * float(x); };
    Image<SoftPixel> pixels = plane(0.1f, slope);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            pixels(x, y).value.weight = 2 * std::exp(0.02f * float(x));
        }
    }
    average_soft_light(pixels, camera_above());
    // By their paths alone they would come out by 100 px2 * 0.02 * 0.05 = 0.1 too bright.
    for (int x = 64; x < kWidth - 64; ++x) {
        EXPECT_NEAR(pixels(x, kHeight / 2).value.with[0], slope(x, 0), 0.01f);
    }
}

TEST(SoftLight, NothingIsCarriedAcrossAnEdgeOrFromAnotherHeight) {
    for (const bool is_edge : {true, false}) {
        Image<SoftPixel> pixels =
            plane(0.1f, [](int x, int) { return x < kWidth / 2 ? 1.0f : 5.0f; });
        for (int y = 0; y < kHeight; ++y) {
            for (int x = kWidth / 2; x < kWidth; ++x) {
                if (is_edge) pixels(x, y).normal = Vec3f(1, 0, 0);
                if (!is_edge) pixels(x, y).position.z() = 0.03f;
            }
        }
        average_soft_light(pixels, camera_above());
        for (int x = 0; x < kWidth; ++x) {
            EXPECT_NEAR(pixels(x, 30).value.with[1], x < kWidth / 2 ? 1.0f : 5.0f, 1e-5f);
        }
    }
}

TEST(SoftLight, NearSurfacesKeepItSharp) {
    Image<SoftPixel> pixels =
        plane(0.001f, [](int x, int) { return x < kWidth / 2 ? 1.0f : 5.0f; });
    average_soft_light(pixels, camera_above());
    EXPECT_NEAR(pixels(kWidth / 2 - 1, 30).value.with[1], 1.0f, 0.05f);
    EXPECT_NEAR(pixels(kWidth / 2, 30).value.with[1], 5.0f, 0.05f);
}

TEST(SoftLight, PixelsWithoutPathsTakeTheirNeighbours) {
    Image<SoftPixel> pixels = plane(0.1f, [](int, int) { return 2.0f; });
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            if ((x + y) % 3 != 0) pixels(x, y).value = SoftValue{};
        }
    }
    average_soft_light(pixels, camera_above());
    for (const SoftPixel& pixel : pixels) EXPECT_NEAR(pixel.value.with[2], 2.0f, 1e-5f);
}

}  // namespace
}  // namespace vitrine
