#include "base/parallel.h"
#include "render/render_object.h"
#include "render/translucent_shadow_map.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

Relief ball(int size, double radius) {
    Relief relief;
    relief.mask = Mask(size, size);
    relief.depth_px = ImageF(size, size);
    relief.normals = Image<Vec3f>(size, size, Vec3f(0, 0, 1));
    relief.inradius_px = radius;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double u = x - 0.5 * (size - 1), v = 0.5 * (size - 1) - y;
            const double rest = radius * radius - u * u - v * v;
            if (rest <= 0) continue;
            relief.mask(x, y) = 255;
            relief.depth_px(x, y) = static_cast<float>(std::sqrt(rest));
            relief.normals(x, y) = Vec3f(static_cast<float>(u), static_cast<float>(v),
                                         static_cast<float>(std::sqrt(rest)))
                                       .normalized();
        }
    }
    return relief;
}

ViewLights key_and_back() {
    ViewLights lights;
    lights.lights.push_back({Vec3(-0.5, 0.5, 0.7).normalized(), Rgbd(2, 2, 2)});
    lights.lights.push_back({Vec3(0.6, 0.4, -0.7).normalized(), Rgbd(3, 2, 1)});
    lights.ambient = Rgbd::Constant(0.1);
    return lights;
}

/// Largest relative difference to the brute force over the object, mean of channels.
double mean_error(const ImageRgb& image, const ImageRgb& truth, const Mask& mask) {
    double sum = 0, norm = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127 || truth[i].isZero()) continue;
        sum += (image[i] - truth[i]).abs().sum();
        norm += truth[i].sum();
    }
    return sum / norm;
}

TEST(Translucent, CoarseLatticeAgreesWithBruteForce) {
    const Relief relief = ball(128, 58);
    const ReliefIrradiance irradiance = irradiance_from_lights(relief, key_and_back(), 1.3);
    TranslucentRenderOptions options;
    options.cells_per_side = 1100;  // cells of 3 pixels
    for (const double width : {4.0, 8.0, 16.0}) {
        const TwoExponentials fit{0.05 / (width * width), -1 / width, 0.01 / (width * width),
                                  -0.4 / width};
        const RadialProfile profile = tabulate({fit, fit.scaled(1.3), fit.scaled(0.7)}, 0.01, 300);
        const ImageRgb truth =
            render_translucent_brute_force(relief, irradiance, profile, options, 3);
        const TranslucentRelief renderer(relief, options);
        EXPECT_LT(mean_error(renderer.render(irradiance, profile), truth, relief.mask), 0.01)
            << width;
    }
}

TEST(Translucent, MeasuredJumpsAreClosedByWalls) {
    // A block with two steps: flat heights 50 | 20 | 30, so walls of 30 and 10 pixels.
    constexpr int kSize = 90, kTall = 60;
    Relief block;
    block.mask = Mask(kSize, kSize);
    block.depth_px = ImageF(kSize, kSize);
    block.normals = Image<Vec3f>(kSize, kSize, Vec3f(0, 0, 1));
    block.inradius_px = 30;
    for (int y = 0; y < kTall; ++y) {
        for (int x = 0; x < kSize; ++x) {
            block.mask(x, y) = 255;
            block.depth_px(x, y) = x < 30 ? 50.0f : x < 60 ? 20.0f : 30.0f;
        }
    }
    const std::size_t unmeasured = sample_relief(block, 300).position.size();
    block.is_measured = true;
    const ReliefSamples samples = sample_relief(block, 300);
    ASSERT_EQ(unmeasured, 2 * samples.front_count);
    double right = 0, left = 0;
    for (std::size_t i = unmeasured; i < samples.position.size(); ++i) {
        const bool is_first = samples.position[i].x() < 45;
        EXPECT_EQ(samples.normal[i], Vec3f(is_first ? 1 : -1, 0, 0));
        EXPECT_GT(samples.position[i].z(), 20);
        (is_first ? right : left) += samples.area_px2[i];
    }
    EXPECT_NEAR(right, 30 * kTall, 1);
    EXPECT_NEAR(left, 10 * kTall, 1);
    // Steep is not a jump.
    Relief round = ball(200, 80);
    round.is_measured = true;
    const ReliefSamples smooth = sample_relief(round, 500);
    EXPECT_EQ(smooth.position.size(), 2 * smooth.front_count);
}

TEST(Translucent, NarrowKernelIsLambertian) {
    const Relief relief = ball(160, 70);
    ViewLights lights;
    lights.lights.push_back({Vec3(0, 0, 1), Rgbd::Ones()});
    const ReliefIrradiance irradiance = irradiance_from_lights(relief, lights, 1.0);
    const TwoExponentials fit{0.5 / (2 * kPi) * 100, -10.0, 0, -1};  // albedo 0.5, 0.1 px wide
    TranslucentRenderOptions options;
    options.eta = 1.0;
    const ImageRgb image =
        TranslucentRelief(relief, options).render(irradiance, tabulate({fit, fit, fit}, 1e-3, 20));
    EXPECT_NEAR(image(80, 80)[0], 0.5 / kPi, 0.01);
    EXPECT_NEAR(image(110, 80)[1], 0.5 / kPi * relief.normals(110, 80).z(), 0.01);
}

TEST(Translucent, BackLightGlowsThroughThinParts) {
    const Relief relief = ball(128, 58);
    ViewLights lights;
    lights.lights.push_back({Vec3(0, 0, -1), Rgbd::Ones()});
    const ReliefIrradiance irradiance = irradiance_from_lights(relief, lights, 1.3);
    const TwoExponentials fit{1e-3, -1 / 15.0, 0, -1};
    const ImageRgb image =
        TranslucentRelief(relief).render(irradiance, tabulate({fit, fit, fit}, 0.01, 300));
    EXPECT_GT(image(64, 64)[0], 0);
    EXPECT_GT(image(64 + 52, 64)[0], 3 * image(64, 64)[0]);  // thin near the rim
}

TEST(Translucent, NormalisedLightsReachPi) {
    const Relief relief = ball(100, 40);
    ViewLights lights = key_and_back();
    normalise_lights(lights, relief, 1.3);
    const ReliefIrradiance irradiance = irradiance_from_lights(relief, lights, 1.3);
    float brightest = 0;
    for (const Rgb& e : irradiance.front) brightest = std::max(brightest, luminance(e));
    EXPECT_NEAR(brightest, kPi, 1e-4);
}

TEST(Translucent, ShadowMapsComeNearTheSumOfTheFrontSide) {
    const Relief relief = ball(128, 58);
    ViewLights lights;
    lights.lights.push_back({Vec3(-0.3, 0.4, 0.87).normalized(), Rgbd::Ones()});
    ReliefIrradiance irradiance = irradiance_from_lights(relief, lights, 1.3);
    for (Rgb& back : irradiance.back) back.setZero();
    const TwoExponentials fit{1.5e-3, -1 / 7.0, 0, -1};
    const RadialProfile profile = tabulate({fit, fit, fit}, 0.01, 200);
    TranslucentRenderOptions options;
    options.use_curved_body = false;
    const ImageRgb sum = TranslucentRelief(relief, options).render(irradiance, profile);
    const ImageRgb maps = render_translucent_shadow_maps(relief, lights, profile, options);
    EXPECT_LT(mean_error(maps, sum, relief.mask), 0.3);
    // What the published maps lose: a light from behind reaches only the rim.
    lights.lights[0].direction = Vec3(0, 0, -1);
    const ImageRgb lost = render_translucent_shadow_maps(relief, lights, profile, options);
    EXPECT_EQ(lost(64, 64)[0], 0);
}

TEST(Translucent, ObjectShadowsItself) {
    // Two balls in the line of the light: the second lies in the shadow of the first.
    Relief cluster;
    cluster.mask = Mask(200, 100);
    cluster.depth_px = ImageF(200, 100);
    cluster.normals = Image<Vec3f>(200, 100, Vec3f(0, 0, 1));
    cluster.ball_of = Image<std::int16_t>(200, 100, -1);
    cluster.inradius_px = 30;
    cluster.balls = {{Vec3f(50, -50, 0), 30}, {Vec3f(130, -50, 0), 30}};
    const std::vector<Vec3f> position = {{20, -50, 0}, {100, -50, 0}, {160, -50, 0}};
    const std::vector<Vec3f> normal = {{-1, 0, 0}, {-1, 0, 0}, {1, 0, 0}};
    const std::vector<std::int16_t> ball_index = {0, 1, 1};
    const SurfacePoints points{position, normal, ball_index};
    EXPECT_EQ(Occluder(cluster).visibility(points, Vec3(-1, 0, 0)), (std::vector<float>{1, 0, 0}));
    EXPECT_EQ(Occluder(cluster).visibility(points, Vec3(1, 0, 0)), (std::vector<float>{0, 0, 1}));
    Relief bunch = cluster;
    bunch.unseen_balls = {{Vec3f(-30, -50, 0), 30}};
    EXPECT_EQ(Occluder(bunch).visibility(points, Vec3(-1, 0, 0)), (std::vector<float>{0, 0, 0}));
    const SkyShares sky = sky_shares(Occluder(cluster), points);
    EXPECT_FLOAT_EQ(sky.ambient[0], 1);
    EXPECT_LT(sky.ambient[1], 0.95f);
    EXPECT_NEAR(sky.below[0], 0.5, 0.05);
}

TEST(Translucent, EvenLightOnOneBodyNeedsNoShadows) {
    const Relief relief = ball(100, 40);
    ViewLights lights;
    lights.ambient = Rgbd::Constant(0.5);
    lights.from_below = Rgbd::Constant(0.4);
    const ReliefIrradiance plain = irradiance_from_lights(relief, lights, 1.3);
    const ReliefIrradiance shadowed = irradiance_with_shadows(relief, lights, 1.3);
    EXPECT_NEAR(plain.front(50, 30)[0], shadowed.front(50, 30)[0], 0.03);
    EXPECT_NEAR(plain.back(50, 70)[1], shadowed.back(50, 70)[1], 0.03);
}

TEST(Translucent, ClosedBodyPassesMoreThanTheFlatProfile) {
    const Relief relief = ball(128, 58);
    const ReliefIrradiance irradiance = irradiance_from_lights(relief, key_and_back(), 1.3);
    const TwoExponentials fit{4e-4, -1 / 15.0, 0, -1};
    const RadialProfile profile = tabulate({fit, fit, fit}, 0.01, 300);
    TranslucentRenderOptions flat;
    flat.use_curved_body = false;
    const float curved = TranslucentRelief(relief).render(irradiance, profile)(64, 64)[0];
    const float plain = TranslucentRelief(relief, flat).render(irradiance, profile)(64, 64)[0];
    EXPECT_GT(curved, 1.1f * plain);
    EXPECT_LT(curved, 2.0f * plain);
}

TEST(Translucent, SameBitsOnAnyThreadCount) {
    const Relief relief = ball(100, 40);
    const ReliefIrradiance irradiance = irradiance_from_lights(relief, key_and_back(), 1.3);
    const TwoExponentials fit{0.01, -0.2, 0, -1};
    const RadialProfile profile = tabulate({fit, fit, fit}, 0.01, 200);
    set_thread_count(1);
    const ImageRgb one = TranslucentRelief(relief).render(irradiance, profile);
    set_thread_count(0);
    const ImageRgb all = TranslucentRelief(relief).render(irradiance, profile);
    for (std::size_t i = 0; i < one.size(); ++i) EXPECT_TRUE((one[i] == all[i]).all());
}

}  // namespace
}  // namespace vitrine
