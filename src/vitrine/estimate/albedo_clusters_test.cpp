#include "estimate/albedo_clusters.h"

#include "base/rng.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

/// A painted square of 0.1 m; `paint` says which albedo lies where.
template <typename Paint>
std::vector<ObjectPixel> painted(const Paint& paint, float noise, std::vector<Rgb>& irradiance) {
    std::vector<ObjectPixel> pixels;
    Rng rng(2);
    for (int k = 0; k < 4000; ++k) {
        ObjectPixel p;
        p.frame = k % 6;
        p.surface.position = Vec3f(0.1f * rng.next_float(), 0.1f * rng.next_float(), 0.0f);
        const float light = 0.5f + rng.next_float();
        irradiance.push_back(Rgb::Constant(light));
        const float grain = 1.0f + noise * (rng.next_float() - 0.5f);
        // One view in five sees a highlight.
        const float gloss = k % 5 == 0 ? 0.4f * rng.next_float() : 0.0f;
        p.radiance = paint(p.surface.position) * light / kPif * grain + gloss;
        pixels.push_back(p);
    }
    return pixels;
}

TEST(AlbedoClusters, FindsThreePaints) {
    std::vector<Rgb> irradiance;
    const auto paint = [](const Vec3f& p) { return p.x() < 0.04f ? 0 : p.y() < 0.05f ? 1 : 2; };
    const std::vector<Rgb> albedo = {Rgb(0.5f, 0.1f, 0.1f), Rgb(0.1f, 0.4f, 0.15f),
                                     Rgb(0.1f, 0.12f, 0.45f)};
    const std::vector<ObjectPixel> pixels =
        painted([&](const Vec3f& p) { return albedo[static_cast<std::size_t>(paint(p))]; }, 0.1f,
                irradiance);
    const AlbedoClusters clusters = find_albedo_clusters(pixels, irradiance);
    ASSERT_EQ(clusters.count, 3);
    // Labels are names: compare pairs of pixels.
    int wrong = 0;
    for (std::size_t i = 0; i + 1 < pixels.size(); ++i)
        wrong += (paint(pixels[i].surface.position) == paint(pixels[i + 1].surface.position)) !=
                 (clusters.of_pixel[i] == clusters.of_pixel[i + 1]);
    EXPECT_LT(wrong, 400);  // cells on a border
    double sum = 0.0;
    for (const double s : clusters.share) sum += s;
    EXPECT_NEAR(sum, 1.0, 1e-9);
    EXPECT_EQ(clusters.at(Vec3f(0.01f, 0.01f, 0)), clusters.at(Vec3f(0.02f, 0.09f, 0)));
}

TEST(AlbedoClusters, OnePaintStaysOne) {
    std::vector<Rgb> irradiance;
    const std::vector<ObjectPixel> pixels =
        painted([](const Vec3f&) { return Rgb(0.3f, 0.2f, 0.1f); }, 0.4f, irradiance);
    EXPECT_EQ(find_albedo_clusters(pixels, irradiance).count, 1);
}

TEST(AlbedoClusters, TooLittleIsOnePaint) { EXPECT_EQ(find_albedo_clusters({}, {}).count, 1); }

}  // namespace
}  // namespace vitrine
