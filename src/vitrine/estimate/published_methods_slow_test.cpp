#include "estimate/scene_estimate.h"
#include "synthetic/world.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

WorldOptions small(std::uint64_t seed, WorldObject object) {
    WorldOptions options;
    options.seed = seed;
    options.object = object;
    options.view_count = 6;
    options.samples_per_pixel = 12;
    return options;
}

double light_error_deg(const LightEstimate& light, const World& world) {
    return degrees(angle_between(light.lights.at(0).light.position_m, world.lights[0].position_m));
}

EstimateOptions options_of(EstimateMethod method) {
    EstimateOptions options;
    options.method = method;
    options.paper.lights.photon_count = 30'000;
    options.paper.caustic_photon_count = 4e5;
    options.paper.ior_step = 0.02;
    return options;
}

TEST(PublishedMethods, PaperFindsIndexOnItsGrid) {
    const World world = make_world(small(3, WorldObject::Glass));
    EstimateOptions options = options_of(EstimateMethod::Paper);
    ObjectOverride known;  // the printed rule is chance: what follows it is under test
    known.id = "object_0";
    known.object_class = ObjectClass::Transparent;
    options.overrides.objects = {known};
    const SceneEstimate e = estimate_scene(world.labelled, world.capture, options);
    EXPECT_EQ(e.method, EstimateMethod::Paper);
    ASSERT_FALSE(e.light.lights.empty());
    // Where it was found at first, or one of the ring of places around that.
    const LightEstimate first = estimate_first_light(world.labelled, world.capture, options);
    const double moved_deg =
        degrees(angle_between(e.light.lights[0].light.position_m - e.light.reference_point_m,
                              first.lights.at(0).light.position_m - first.reference_point_m));
    EXPECT_TRUE(moved_deg < 0.01 || std::abs(moved_deg - options.paper.local_radius_deg) < 0.01)
        << moved_deg;
    ASSERT_EQ(e.objects.size(), 1u);
    const double ior = std::get<Dielectric>(world.truth.parts[1].material).ior;
    EXPECT_NEAR(e.objects[0].ior.value, ior, 0.15);
    const double steps = (e.objects[0].ior.value - 1.2) / 0.02;
    EXPECT_NEAR(steps, std::round(steps), 1e-6);
    EXPECT_LE(e.error_joint, e.error_initial);
}

TEST(PublishedMethods, PaperFitsMetal) {
    const World world = make_world(small(4, WorldObject::Metal));
    EstimateOptions options = options_of(EstimateMethod::Paper);
    ObjectOverride known;
    known.id = "object_0";
    known.object_class = ObjectClass::Specular;
    options.overrides.objects = {known};
    const SceneEstimate e = estimate_scene(world.labelled, world.capture, options);
    const double sigma = std::get<Ward>(world.truth.parts[1].material).sigma_x;
    // The light of a grid is off by degrees: the lobe pays for it.
    EXPECT_GT(e.objects.at(0).clusters.at(0).fit.ward.sigma_x, 0.4 * sigma);
    EXPECT_LT(e.objects[0].clusters[0].fit.ward.sigma_x, 4.0 * sigma);
    EXPECT_LE(e.error_joint, e.error_initial);
}

TEST(PublishedMethods, BaselinesKnowOnlyDiffuseSurfaces) {
    const World world = make_world(small(3, WorldObject::Glass));
    for (const EstimateMethod method : {EstimateMethod::Local, EstimateMethod::InversePhoton}) {
        SceneEstimate e = estimate_scene(world.labelled, world.capture, options_of(method));
        ASSERT_FALSE(e.light.lights.empty());
        EXPECT_LT(light_error_deg(e.light, world), 60.0) << method_name(method);
        EXPECT_EQ(e.objects.at(0).object_class, ObjectClass::Diffuse);
        EXPECT_TRUE(e.is_complete());
        EXPECT_EQ(method_from_name(method_name(method)), method);
    }
}

TEST(JointLight, HighlightsBringAWrongLightBack) {
    const World world = make_world(small(4, WorldObject::Metal));
    SceneEstimate e = estimate_scene(world.labelled, world.capture);
    ASSERT_EQ(e.objects.at(0).object_class, ObjectClass::Specular);
    LightEstimate wrong = e.light;
    DiscLight& lamp = wrong.lights[0].light;
    const Frame frame(lamp.position_m.normalized().cast<float>());
    lamp.position_m += 0.07 * lamp.position_m.norm() * frame.tangent.cast<double>();
    lamp.normal = -lamp.position_m.normalized();
    ASSERT_GT(light_error_deg(wrong, world), 2.5);
    LightOptions light_options = first_light_options(world.capture, {});
    light_options.object_classes = {ObjectClass::Specular};
    for (const JointMode mode : {JointMode::HighlightsFirst, JointMode::Likelihoods}) {
        JointOptions joint;
        joint.mode = mode;
        JointReport report;
        const LightEstimate back = refine_light_jointly(
            world.labelled, world.capture.frames, world.capture.saturation_level, wrong,
            light_options, {}, joint, e.objects, &report);
        EXPECT_LT(light_error_deg(back, world), 1.5);
        EXPECT_GT(report.moved_deg, 1.0);
        EXPECT_LT(report.object_cost_after, report.object_cost_before);
    }
}

}  // namespace
}  // namespace vitrine
