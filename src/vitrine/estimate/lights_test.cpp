#include "estimate/lights.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "estimate/light_search.h"
#include "estimate/test_table.h"
#include "geometry/primitives.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// A table with two boxes, photographed from six sides under `lights`, without bounces: the
/// same direct model that is fitted, so recovery must be nearly exact.
struct World {
    Scene scene;
    std::vector<RgbdFrame> frames;
};

World make_world(const std::vector<DiscLight>& lights, float ambient, float clip = 1e9f,
                 float texture = 0.0f) {
    World world;
    Mesh scan = make_plane(1.2, 0.0, 120);
    std::vector<Rgb> albedo(scan.vertices.size(), Rgb(0.4f, 0.35f, 0.3f));
    for (const auto& [centre, colour] :
         {std::pair{Vec3(0.12, 0.1, 0.05), Rgb(0.7f, 0.3f, 0.1f)},
          std::pair{Vec3(-0.15, -0.05, 0.05), Rgb(0.2f, 0.3f, 0.6f)}}) {
        append(scan, make_box(Vec3(0.08, 0.08, 0.1), centre));
        albedo.resize(scan.vertices.size(), colour);
    }
    scan.colours.assign(scan.vertices.size(), Rgb::Zero());
    Part part;
    part.name = "scan";
    Diffuse diffuse;
    diffuse.use_vertex_colours = true;
    part.material = diffuse;
    part.mesh = std::make_shared<const Mesh>(scan);
    world.scene.parts.push_back(part);
    world.scene.cameras = cameras_around_table(6, 160, 120, 150.0);
    world.frames = shaded_frames(world.scene, [&](const EstimationScene& estimation,
                                                  const std::vector<SurfacePoint>& points,
                                                  const std::vector<Hit>& hits) {
        std::vector<Rgb> irradiance(points.size(), Rgb::Zero());
        for (const DiscLight& light : lights) {
            const DirectColumn column =
                direct_column(estimation, points, {light.position_m, light.normal, light.radius_m},
                              24, kScanMask, 0);
            for (std::size_t i = 0; i < points.size(); ++i)
                irradiance[i] += column.clear[i] * light.intensity_w_per_sr;
        }
        const GatheredLight gathered = gather_light(estimation, points, 12, 0, {}, 7);
        std::vector<Rgb> radiance;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Triangle& t = scan.triangles[static_cast<std::size_t>(hits[i].triangle)];
            const Vec3f& p = points[i].position;  // squares of paint, 3 cm wide
            const auto square = static_cast<std::uint64_t>(std::floor(p.x() / 0.03f) + 100) +
                                1000 * static_cast<std::uint64_t>(std::floor(p.y() / 0.03f) + 100);
            const float paint = static_cast<float>(mix_bits(square) >> 40) * 0x1p-24f - 0.5f;
            const Rgb colour = (1.0f + texture * paint) * albedo[static_cast<std::size_t>(t[0])];
            radiance.push_back(
                (colour / kPif * (irradiance[i] + ambient * gathered.openness[i])).min(clip));
        }
        return radiance;
    });
    return world;
}

DiscLight aimed(const Vec3& position, double radius_m, float intensity) {
    return {position, -position.normalized(), radius_m, Rgb::Constant(intensity)};
}

double error_deg(const FittedLight& fitted, const Vec3& position) {
    return degrees(angle_between(fitted.light.position_m, position));
}

LightOptions small_options() {
    LightOptions options;
    options.samples.count = 1200;
    options.samples.gather_rays = 16;
    return options;
}

TEST(EstimateLights, RecoversOneLampUnderAmbient) {
    const Vec3 position(0.45, -0.35, 0.6);
    const World world = make_world({aimed(position, 0.04, 3.0f)}, 0.05f);
    const LightEstimate e = estimate_lights(world.scene, world.frames, 1e9, small_options());
    ASSERT_EQ(e.lights.size(), 1u);
    EXPECT_EQ(e.outcome, Outcome::Converged);
    EXPECT_LT(error_deg(e.lights[0], position), 1.0);
    EXPECT_NEAR(e.lights[0].light.position_m.norm(), position.norm(), 0.08 * position.norm());
    EXPECT_LT(e.lights[0].stddev_direction_deg, 2.0);
}

TEST(EstimateLights, TellsTwoLampsFromOne) {
    const Vec3 a(0.45, -0.35, 0.6), b(-0.6, -0.2, 0.7);
    const World world = make_world({aimed(a, 0.03, 3.0f), aimed(b, 0.03, 1.8f)}, 0.0f);
    const LightEstimate e = estimate_lights(world.scene, world.frames, 1e9, small_options());
    ASSERT_EQ(e.lights.size(), 2u);
    const bool is_a_first = error_deg(e.lights[0], a) < error_deg(e.lights[0], b);
    EXPECT_LT(error_deg(e.lights[is_a_first ? 0 : 1], a), 2.0);
    EXPECT_LT(error_deg(e.lights[is_a_first ? 1 : 0], b), 2.0);
}

TEST(EstimateLights, TwoLampsCloseTogetherAreNotSaidToBeOne) {
    const Vec3 a(0.45, -0.35, 0.6);
    const Vec3 b = Eigen::AngleAxisd(radians(20.0), Vec3::UnitZ()) * a;
    const World world = make_world({aimed(a, 0.01, 3.0f), aimed(b, 0.01, 2.4f)}, 0.0f);
    const LightEstimate e = estimate_lights(world.scene, world.frames, 1e9, small_options());
    EXPECT_TRUE(e.lights.size() == 2 || e.outcome == Outcome::Ambiguous);
    EXPECT_EQ(e.outcome == Outcome::Ambiguous, !e.reason.empty());
}

TEST(EstimateLights, AWeakSecondLampIsFoundOnATextureTwiceItsShadow) {
    // A fifth of the light: its shadows are fainter than the paint of the table.
    const Vec3 a(0.45, -0.35, 0.6), b(-0.6, -0.2, 0.7);
    const World world = make_world({aimed(a, 0.03, 3.0f), aimed(b, 0.03, 1.0f)}, 0.02f, 1e9f, 0.5f);
    LightOptions options = small_options();
    options.samples.count = 1600;
    const LightEstimate e = estimate_lights(world.scene, world.frames, 1e9, options);
    ASSERT_EQ(e.lights.size(), 2u);
    const bool is_a_first = error_deg(e.lights[0], a) < error_deg(e.lights[0], b);
    EXPECT_LT(error_deg(e.lights[is_a_first ? 0 : 1], a), 3.0);
    EXPECT_LT(error_deg(e.lights[is_a_first ? 1 : 0], b), 6.0);
}

TEST(EstimateLights, WhatOneLampMayTakeFromAnotherIsInDoubt) {
    const DiscLight strong = aimed(Vec3(0.45, -0.35, 0.6), 0.03, 3.0f);
    const DiscLight weak = aimed(Vec3(-0.6, -0.2, 0.7), 0.03, 1.5f);
    LightOptions options = small_options();
    options.samples.count = 1000;
    const auto fitted = [&](const std::vector<DiscLight>& lamps, float texture) {
        const World world = make_world(lamps, 0.02f, 1e9f, texture);
        options.start = lamps;
        return estimate_lights(world.scene, world.frames, 1e9, options).lights;
    };
    const std::vector<FittedLight> alone = fitted({strong}, 0.3f);
    const std::vector<FittedLight> plain = fitted({strong, weak}, 0.0f);
    const std::vector<FittedLight> painted = fitted({strong, weak}, 0.3f);
    ASSERT_EQ(painted.size(), 2u);
    EXPECT_GT(painted[0].stddev_irradiance_ratio, alone[0].stddev_irradiance_ratio);
    EXPECT_GT(painted[1].stddev_intensity_ratio, painted[0].stddev_intensity_ratio);
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_GT(painted[k].stddev_intensity_ratio, plain[k].stddev_intensity_ratio);
        EXPECT_LT(painted[k].stddev_intensity_ratio, 0.5);
    }
}

TEST(EstimateLights, ARivalMakesThemAmbiguousAndIsKept) {
    LightEstimate e;
    e.outcome = Outcome::Converged;
    e.lights.resize(2);
    e.lights[0].outcome = Outcome::Converged;
    e.lights[1].outcome = Outcome::AtBound;
    doubt_by_rival(e, "another");
    EXPECT_EQ(e.outcome, Outcome::Ambiguous);
    EXPECT_EQ(e.lights[0].outcome, Outcome::Ambiguous);
    EXPECT_EQ(e.lights[1].outcome, Outcome::AtBound);
    EXPECT_EQ(e.rival, "another");
}

TEST(EstimateLights, KnownLightsAreTakenAsTheyAre) {
    const DiscLight lamp = aimed(Vec3(0.4, 0.3, 0.6), 0.04, 3.0f);
    const World world = make_world({lamp}, 0.05f);
    LightOptions options = small_options();
    options.known_lights = {lamp};
    const LightEstimate e = estimate_lights(world.scene, world.frames, 1e9, options);
    ASSERT_EQ(e.lights.size(), 1u);
    EXPECT_EQ(e.lights[0].light.position_m, lamp.position_m);
    EXPECT_EQ(e.lights[0].light.radius_m, lamp.radius_m);
    EXPECT_TRUE((e.lights[0].light.intensity_w_per_sr == 3.0f).all());
    EXPECT_EQ(e.lights[0].stddev_direction_deg, 0.0);
    EXPECT_EQ(e.outcome, Outcome::Converged);
    EXPECT_EQ(e.albedo_anchor, "known_lights");
    EXPECT_NEAR(e.ambient_radiance[1], 0.05, 0.02);

    const DirectionalLight sun{Vec3(0, 0.6, -0.8), Rgb::Constant(2.5f)};
    options.known_lights = {sun, PointLight{Vec3(-0.5, 0.2, 0.7), Rgb(1.0f, 2.0f, 3.0f)}};
    const LightEstimate both = estimate_lights(world.scene, world.frames, 1e9, options);
    const std::vector<Light> lights = to_lights(both);
    ASSERT_EQ(lights.size(), 2u);
    EXPECT_LT((std::get<DirectionalLight>(lights[0]).direction - sun.direction).norm(), 1e-9);
    EXPECT_NEAR(std::get<DirectionalLight>(lights[0]).irradiance_w_per_m2[0], 2.5, 1e-4);
    EXPECT_EQ(std::get<DiscLight>(lights[1]).position_m, Vec3(-0.5, 0.2, 0.7));
    EXPECT_TRUE((std::get<DiscLight>(lights[1]).intensity_w_per_sr == Rgb(1, 2, 3)).all());

    options.known_lights = {SpotLight{}};
    EXPECT_THROW(estimate_lights(world.scene, world.frames, 1e9, options), InputError);
}

TEST(EstimateLights, ALampInsideTheSceneLiesAtTheBound) {
    // As a lamp inside of a glass body does: nearer than lights are looked for.
    const World world = make_world({aimed(Vec3(0.02, 0.01, 0.14), 0.01, 0.3f)}, 0.0f);
    LightOptions options = small_options();
    options.max_lights = 1;
    const LightEstimate e = estimate_lights(world.scene, world.frames, 1e9, options);
    EXPECT_NE(e.outcome, Outcome::Converged);
    EXPECT_FALSE(e.reason.empty());
    for (const FittedLight& fitted : e.lights)
        EXPECT_TRUE(fitted.light.position_m.allFinite() &&
                    std::isfinite(fitted.stddev_direction_deg));
}

TEST(EstimateLights, SaysWhenEverythingIsClipped) {
    const World world = make_world({aimed(Vec3(0.4, 0.3, 0.6), 0.04, 3.0f)}, 0.05f, 0.02f);
    const LightEstimate e = estimate_lights(world.scene, world.frames, 0.02, small_options());
    EXPECT_EQ(e.outcome, Outcome::NotIdentifiable);
    EXPECT_FALSE(e.reason.empty());
}

TEST(EstimateLights, SameBitsForAnyThreadCount) {
    const World world = make_world({aimed(Vec3(0.45, -0.35, 0.6), 0.04, 3.0f)}, 0.05f);
    LightOptions options = small_options();
    options.samples.count = 400;
    options.max_lights = 1;
    const LightEstimate a = estimate_lights(world.scene, world.frames, 1e9, options);
    set_thread_count(1);
    const LightEstimate b = estimate_lights(world.scene, world.frames, 1e9, options);
    set_thread_count(0);
    EXPECT_EQ(a.lights[0].light.position_m, b.lights[0].light.position_m);
    EXPECT_TRUE((a.ambient_radiance == b.ambient_radiance).all());
}

}  // namespace
}  // namespace vitrine
