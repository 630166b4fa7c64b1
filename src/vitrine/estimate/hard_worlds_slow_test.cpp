// Worlds in which something is hard or cannot be known: what is asked for must come out right, or
// the answer must say that it cannot.
#include "estimate/estimate_json.h"
#include "estimate/scene_estimate.h"
#include "synthetic/world.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

WorldOptions quick(std::uint64_t seed, WorldObject object) {
    WorldOptions options;
    options.seed = seed;
    options.object = object;
    options.view_count = 7;
    options.width = 160;
    options.height = 120;
    options.samples_per_pixel = 10;
    options.photon_count = 100'000;
    return options;
}

DiscLight lamp_at(const Vec3& position, double radius_m, float intensity) {
    return {position, -position.normalized(), radius_m, Rgb::Constant(intensity)};
}

double light_error_deg(const SceneEstimate& e, const World& world, std::size_t k = 0) {
    double least = 180.0;
    for (const FittedLight& fitted : e.light.lights)
        least = std::min(
            least, degrees(angle_between(fitted.light.position_m, world.lights[k].position_m)));
    return least;
}

/// Every number that goes to the file is one.
void expect_finite(const SceneEstimate& e) {
    for (const FittedLight& light : e.light.lights) {
        EXPECT_TRUE(light.light.position_m.allFinite());
        EXPECT_TRUE(std::isfinite(light.stddev_direction_deg));
        EXPECT_TRUE(std::isfinite(light.stddev_distance_m));
        EXPECT_TRUE(light.light.intensity_w_per_sr.isFinite().all());
    }
    EXPECT_TRUE(e.light.ambient_radiance.isFinite().all());
    for (const ObjectEstimate& object : e.objects) {
        EXPECT_TRUE(std::isfinite(object.class_margin));
        EXPECT_TRUE(std::isfinite(object.ior.value) && std::isfinite(object.ior.stddev));
        EXPECT_TRUE(object.sigma_a_per_m.value.isFinite().all());
        EXPECT_TRUE(object.sigma_a_per_m.stddev.isFinite().all());
        for (const WardCluster& cluster : object.clusters) {
            EXPECT_TRUE(std::isfinite(cluster.fit.ward.sigma_x));
            EXPECT_TRUE(cluster.fit.ward.rho_s.isFinite().all());
            EXPECT_TRUE(std::isfinite(cluster.fit.sigma.stddev));
        }
    }
}

SceneEstimate estimate(const World& world, const EstimateOptions& options = {}) {
    SceneEstimate e = estimate_scene(world.labelled, world.capture, options);
    expect_finite(e);
    return e;
}

// ---- classes ------------------------------------------------------------------------------------

TEST(HardClasses, ABottleWithStrongHighlightsStaysTransparent) {
    WorldOptions options = quick(21, WorldObject::Glass);
    options.shape = WorldShape::Bottle;
    options.lamps = {lamp_at(Vec3(0.5, -0.3, 0.6), 0.16, 3.0f)};
    options.ambient_radiance = Rgb::Constant(0.25f);
    const SceneEstimate e = estimate(make_world(options));
    EXPECT_EQ(e.objects.at(0).object_class, ObjectClass::Transparent);
    EXPECT_FALSE(e.objects[0].is_hollow);
}

TEST(HardClasses, ADarkPlasticThingEndsAsDiffuse) {
    WorldOptions options = quick(22, WorldObject::Plastic);
    options.shape = WorldShape::Pebble;
    const SceneEstimate e = estimate(make_world(options));
    EXPECT_EQ(e.objects.at(0).object_class, ObjectClass::Diffuse);
    EXPECT_TRUE(e.is_complete());
}

TEST(HardClasses, AMirrorOfTheRoomIsNotDiffuseTexture) {
    WorldOptions options = quick(23, WorldObject::Metal);
    options.shape = WorldShape::Ball;
    Ward chrome;
    chrome.rho_d = Rgb::Constant(0.03f);
    chrome.rho_s = Rgb::Constant(0.7f);
    chrome.sigma_x = chrome.sigma_y = 0.03;
    options.material = chrome;
    const SceneEstimate e = estimate(make_world(options));
    EXPECT_EQ(e.objects.at(0).object_class, ObjectClass::Specular);
}

TEST(HardClasses, ADrinkingGlassIsHollowOrUnsureNeverSolid) {
    for (const std::uint64_t seed : {24, 25}) {
        const SceneEstimate e = estimate(make_world(quick(seed, WorldObject::Vessel)));
        const ObjectEstimate& object = e.objects.at(0);
        EXPECT_NE(object.object_class, ObjectClass::Specular) << seed;
        EXPECT_NE(object.object_class, ObjectClass::Diffuse) << seed;
        EXPECT_TRUE(object.object_class == ObjectClass::Unsure || object.is_hollow) << seed;
        EXPECT_FALSE(e.is_complete()) << seed;
    }
}

// ---- lights -------------------------------------------------------------------------------------

TEST(HardLights, TheSunIsDistant) {
    WorldOptions options = quick(31, WorldObject::None);
    options.is_sunny = true;
    const World world = make_world(options);
    const SceneEstimate e = estimate(world);
    ASSERT_EQ(e.light.lights.size(), 1u);
    EXPECT_TRUE(e.light.lights[0].is_distant);
    EXPECT_EQ(e.light.outcome, Outcome::Converged);
    const Vec3 found = e.light.lights[0].light.position_m - e.light.reference_point_m;
    EXPECT_LT(degrees(angle_between(found, world.lights[0].position_m)), 2.5);
    const auto sun = std::get<DirectionalLight>(to_lights(e.light)[0]);
    const auto truth = std::get<DirectionalLight>(world.truth.lights[0]);
    EXPECT_NEAR(sun.irradiance_w_per_m2[1], truth.irradiance_w_per_m2[1],
                0.12 * truth.irradiance_w_per_m2[1]);
}

TEST(HardLights, ALampIsNotTheSun) {
    WorldOptions options = quick(32, WorldObject::None);
    options.lamps = {lamp_at(Vec3(0.45, -0.4, 0.6), 0.04, 2.0f)};
    const World world = make_world(options);
    const SceneEstimate e = estimate(world);
    ASSERT_EQ(e.light.lights.size(), 1u);
    const FittedLight& fitted = e.light.lights[0];
    EXPECT_FALSE(fitted.is_distant);
    EXPECT_LT(light_error_deg(e, world), 2.5);
    EXPECT_NEAR(fitted.light.position_m.norm(), world.lights[0].position_m.norm(), 0.08);
}

TEST(HardLights, TwoLampsByEvidence) {
    WorldOptions options = quick(33, WorldObject::None);
    options.light_count = 2;
    const World world = make_world(options);
    const SceneEstimate e = estimate(world);
    ASSERT_EQ(e.light.lights.size(), 2u);
    EXPECT_LT(light_error_deg(e, world, 0), 5.0);
    EXPECT_LT(light_error_deg(e, world, 1), 5.0);
}

TEST(HardLights, TheRadiusOfALargeLamp) {
    WorldOptions options = quick(34, WorldObject::None);
    options.lamps = {lamp_at(Vec3(0.5, 0.3, 0.6), 0.12, 2.5f)};
    const SceneEstimate e = estimate(make_world(options));
    ASSERT_EQ(e.light.lights.size(), 1u);
    EXPECT_NEAR(e.light.lights[0].light.radius_m, 0.12, 0.4 * 0.12);
}

TEST(HardLights, BodiesOffByACentimetreUnderStrongTexture) {
    WorldOptions options = quick(35, WorldObject::None);
    options.scan_error_m = 0.01;
    options.texture = 2.0;
    const World world = make_world(options);
    EXPECT_LT(light_error_deg(estimate(world), world), 6.0);
}

TEST(HardLights, AThirdOfThePictureClipped) {
    WorldOptions options = quick(36, WorldObject::None);
    options.lamps = {lamp_at(Vec3(-0.4, 0.4, 0.6), 0.04, 8.0f)};
    const World world = make_world(options);
    const SceneEstimate e = estimate(world);
    EXPECT_LT(light_error_deg(e, world), 4.0);
}

// ---- what cannot be known -----------------------------------------------------------------------

TEST(Unknowable, EverythingClipped) {
    WorldOptions options = quick(41, WorldObject::Glass);
    options.saturation_level = 0.01;
    const SceneEstimate e = estimate(make_world(options));
    EXPECT_EQ(e.light.outcome, Outcome::NotIdentifiable);
    EXPECT_FALSE(e.light.reason.empty());
    EXPECT_FALSE(e.is_complete());
}

TEST(Unknowable, OneView) {
    WorldOptions options = quick(42, WorldObject::Glass);
    options.view_count = 1;
    const SceneEstimate e = estimate(make_world(options));
    EXPECT_FALSE(e.is_complete());
    EXPECT_EQ(e.light.outcome, Outcome::NotIdentifiable);
    EXPECT_EQ(e.objects.at(0).ior.outcome, Outcome::NotIdentifiable);
    EXPECT_NE(e.objects[0].ior.reason.find("one view"), std::string::npos);
}

TEST(Unknowable, MetalInTheShadow) {
    WorldOptions options = quick(43, WorldObject::Metal);
    options.shape = WorldShape::Ball;
    options.lamps = {lamp_at(Vec3(0.5, 0.45, 0.45), 0.03, 2.5f)};
    options.is_shaded = true;
    options.body_count = 2;
    EstimateOptions known;
    known.overrides.objects = {{"object_0", ObjectClass::Specular, {}, {}, false}};
    known.overrides.lights = {options.lamps[0]};
    const SceneEstimate e = estimate(make_world(options), known);
    const WardFit& fit = e.objects.at(0).clusters.at(0).fit;
    EXPECT_EQ(fit.sigma.outcome, Outcome::NotIdentifiable);
    EXPECT_NE(fit.sigma.reason.find("no lamp"), std::string::npos);
    EXPECT_FALSE(e.is_complete());
}

// ---- what the user knows ------------------------------------------------------------------------

class Known : public ::testing::Test {
  protected:
    static const World& world() {
        static const World made = make_world(quick(51, WorldObject::Glass));
        return made;
    }
    static EstimateOptions with(const ObjectOverride& object) {
        EstimateOptions options;
        options.overrides.objects = {object};
        return options;
    }
};

TEST_F(Known, IndexAndAbsorptionAreTakenAsTheyAre) {
    ObjectOverride object{"object_0", ObjectClass::Transparent, 1.37, Rgb(1, 2, 3), false};
    const SceneEstimate e = estimate(world(), with(object));
    EXPECT_EQ(e.objects.at(0).ior.value, 1.37);
    EXPECT_EQ(e.objects[0].ior.stddev, 0.0);
    EXPECT_EQ(e.objects[0].ior.outcome, Outcome::Converged);
    EXPECT_TRUE((e.objects[0].sigma_a_per_m.value == Rgb(1, 2, 3)).all());
    EXPECT_TRUE((e.objects[0].sigma_a_per_m.stddev == 0.0f).all());
    EXPECT_EQ(e.objects[0].sigma_a_per_m.outcome, Outcome::Converged);
}

TEST_F(Known, AClassIsTakenAsItIs) {
    for (const ObjectClass c : {ObjectClass::Specular, ObjectClass::Diffuse}) {
        const SceneEstimate e = estimate(world(), with({"object_0", c, {}, {}, false}));
        EXPECT_EQ(e.objects.at(0).object_class, c);
        EXPECT_TRUE(e.objects[0].reason.find("given") != std::string::npos);
    }
}

TEST_F(Known, IgnoredIsDiffuse) {
    ObjectOverride object;
    object.id = "object_0";
    object.ignore = true;
    const SceneEstimate e = estimate(world(), with(object));
    EXPECT_EQ(e.objects.at(0).object_class, ObjectClass::Diffuse);
    EXPECT_TRUE(e.is_complete());
}

TEST_F(Known, LightsAreTakenAsTheyAre) {
    const DiscLight lamp = lamp_at(Vec3(0.3, 0.5, 0.7), 0.05, 2.25f);
    EstimateOptions options;
    options.overrides.lights = {lamp};
    const SceneEstimate e = estimate(world(), options);
    ASSERT_EQ(e.light.lights.size(), 1u);
    EXPECT_EQ(e.light.lights[0].light.position_m, lamp.position_m);
    EXPECT_EQ(e.light.lights[0].light.normal, lamp.normal);
    EXPECT_EQ(e.light.lights[0].light.radius_m, lamp.radius_m);
    EXPECT_TRUE((e.light.lights[0].light.intensity_w_per_sr == 2.25f).all());
    EXPECT_EQ(e.light.lights[0].stddev_direction_deg, 0.0);
    EXPECT_EQ(e.light.albedo_anchor, "known_lights");

    const DirectionalLight sun{Vec3(0, 0.6, -0.8), Rgb::Constant(3.0f)};
    options.overrides.lights = {sun};
    const SceneEstimate sunny = estimate(world(), options);
    const auto used = std::get<DirectionalLight>(to_lights(sunny.light).at(0));
    EXPECT_LT((used.direction - sun.direction).norm(), 1e-9);
    EXPECT_NEAR(used.irradiance_w_per_m2[0], 3.0, 1e-4);
}

}  // namespace
}  // namespace vitrine
