#include "estimate/scene_estimate.h"
#include "synthetic/world.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

double light_error_deg(const SceneEstimate& e, const World& world) {
    return degrees(
        angle_between(e.light.lights.at(0).light.position_m, world.lights[0].position_m));
}

TEST(EstimateScene, RecoversGlass) {
    WorldOptions options;
    options.seed = 3;
    const World world = make_world(options);
    const auto& truth = std::get<Dielectric>(world.truth.parts[1].material);
    const SceneEstimate e = estimate_scene(world.labelled, world.capture);
    ASSERT_EQ(e.light.lights.size(), 1u);
    EXPECT_LT(light_error_deg(e, world), 2.5);
    ASSERT_EQ(e.objects.size(), 1u);
    EXPECT_EQ(e.objects[0].object_class, ObjectClass::Transparent);
    EXPECT_FALSE(e.objects[0].is_hollow);
    EXPECT_NEAR(e.objects[0].ior.value, truth.ior, 0.03);
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(e.objects[0].sigma_a_per_m.value[c], truth.sigma_a_per_m[c],
                    std::max(1.0f, 0.15f * truth.sigma_a_per_m[c]));

    const Scene applied = apply(world.labelled, e);
    EXPECT_TRUE(std::holds_alternative<Dielectric>(applied.parts[1].material));
    // Albedo of the table near the middle against the paint, shadow of the glass included.
    const Mesh& got = *applied.parts[0].mesh;
    const Mesh& paint = *world.truth.parts[0].mesh;
    double error = 0, count = 0;
    for (std::size_t i = 0; i < got.vertices.size(); ++i)
        if (got.vertices[i].norm() < 0.3f && got.vertices[i].norm() > 0.06f &&
            std::abs(got.vertices[i].z()) < 1e-4f && got.normals[i].z() > 0.5f) {
            error += std::abs(luminance(got.colours[i]) / luminance(paint.colours[i]) - 1.0);
            count += 1;
        }
    EXPECT_LT(error / count, 0.1);
}

TEST(EstimateScene, RecoversMetal) {
    WorldOptions options;
    options.seed = 4;
    options.object = WorldObject::Metal;
    const World world = make_world(options);
    const auto& truth = std::get<Ward>(world.truth.parts[1].material);
    const SceneEstimate e = estimate_scene(world.labelled, world.capture);
    EXPECT_LT(light_error_deg(e, world), 2.5);
    ASSERT_EQ(e.objects.size(), 1u);
    EXPECT_EQ(e.objects[0].object_class, ObjectClass::Specular);
    const Ward& ward = e.objects[0].clusters.at(0).fit.ward;
    EXPECT_NEAR(ward.sigma_x, truth.sigma_x, 0.2 * truth.sigma_x);
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(ward.rho_d[c], truth.rho_d[c], 0.03);
        EXPECT_NEAR(ward.rho_s[c], truth.rho_s[c], 0.25 * truth.rho_s[c]);
    }
}

TEST(EstimateScene, ASceneWithoutCandidatesIsComplete) {
    WorldOptions options;
    options.seed = 5;
    options.object = WorldObject::None;
    options.samples_per_pixel = 12;
    const World world = make_world(options);
    const SceneEstimate e = estimate_scene(world.labelled, world.capture);
    EXPECT_TRUE(e.objects.empty());
    EXPECT_TRUE(e.is_complete());
    EXPECT_LT(light_error_deg(e, world), 2.5);
}

TEST(EstimateScene, APaintedBallIsDiffuse) {
    WorldOptions options;
    options.seed = 6;
    options.object = WorldObject::Metal;
    options.samples_per_pixel = 12;
    options.rho_s_scale = 0.0;
    const World world = make_world(options);
    const SceneEstimate e = estimate_scene(world.labelled, world.capture);
    EXPECT_EQ(e.objects.at(0).object_class, ObjectClass::Diffuse);
}

TEST(EstimateScene, TheUserKnowsBetter) {
    WorldOptions options;
    options.seed = 3;
    options.view_count = 4;
    options.samples_per_pixel = 8;
    const World world = make_world(options);
    EstimateOptions known;
    ObjectOverride object;
    object.id = "object_0";
    object.object_class = ObjectClass::Transparent;
    object.ior = 1.4;
    object.sigma_a_per_m = Rgb(1, 2, 3);
    known.overrides.objects = {object};
    const SceneEstimate e = estimate_scene(world.labelled, world.capture, known);
    EXPECT_EQ(e.objects[0].ior.value, 1.4);
    EXPECT_EQ(e.objects[0].ior.stddev, 0.0);
    EXPECT_EQ(e.objects[0].sigma_a_per_m.value[1], 2.0f);

    EstimateOptions baseline;
    baseline.lambertian = true;
    const SceneEstimate flat = estimate_scene(world.labelled, world.capture, baseline);
    EXPECT_EQ(flat.objects[0].object_class, ObjectClass::Diffuse);
}

TEST(JointLight, ACausticMovesTheLightBackAndTheIndexWithIt) {
    WorldOptions options;
    options.seed = 3;
    options.samples_per_pixel = 12;
    const World world = make_world(options);
    const auto& truth = std::get<Dielectric>(world.truth.parts[1].material);
    LightOptions light_options = first_light_options(world.capture, {});
    light_options.object_classes = {ObjectClass::Transparent};
    light_options.start = world.lights;
    const double clip = world.capture.saturation_level;
    SceneEstimate e;
    e.light = estimate_lights(world.labelled, world.capture.frames, clip, light_options);
    e.objects = estimate_materials(world.labelled, world.capture.frames, clip, e.light);
    ASSERT_EQ(e.objects.at(0).object_class, ObjectClass::Transparent);

    DiscLight& lamp = e.light.lights[0].light;
    const Frame frame(lamp.position_m.normalized().cast<float>());
    lamp.position_m += 0.07 * lamp.position_m.norm() * frame.tangent.cast<double>();
    lamp.normal = -lamp.position_m.normalized();
    ASSERT_GT(light_error_deg(e, world), 2.5);
    e.objects[0].ior.value = truth.ior + 0.04;
    std::vector<ObjectEstimate> known = e.objects;
    known[0].ior = known[0].ior_through = {1.4, 0.0, 0.0, Outcome::Converged, {}};
    JointOptions joint;
    joint.mode = JointMode::Likelihoods;
    JointReport report;
    e.light = refine_light_jointly(world.labelled, world.capture.frames, clip, e.light,
                                   light_options, {}, joint, e.objects, &report);
    EXPECT_GT(report.moved_deg, 1.0);
    EXPECT_LT(light_error_deg(e, world), 1.5);
    EXPECT_NEAR(e.objects[0].ior.value, truth.ior, 0.03);

    refine_light_jointly(world.labelled, world.capture.frames, clip, e.light, light_options, {},
                         joint, known);
    EXPECT_EQ(known[0].ior.value, 1.4);  // what the user knows stays
}

}  // namespace
}  // namespace vitrine
