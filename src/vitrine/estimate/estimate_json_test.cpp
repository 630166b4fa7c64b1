#include "estimate/estimate_json.h"

#include "base/error.h"
#include "base/file.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <memory>
#include <new>

namespace vitrine {
namespace {

std::filesystem::path scratch(const std::string& name) {
    return std::filesystem::path(testing::TempDir()) / name;
}

SceneEstimate example() {
    SceneEstimate e;
    FittedLight fitted;
    fitted.light = {Vec3(0.5, -0.4, 0.8), Vec3(-0.5, 0.4, -0.8).normalized(), 0.04,
                    Rgb(3.0f, 2.5f, 2.0f)};
    fitted.stddev_direction_deg = 0.6;
    fitted.outcome = Outcome::Converged;
    e.light.lights = {fitted};
    e.light.outcome = Outcome::Converged;
    e.light.ambient_radiance = Rgb(0.01f, 0.02f, 0.03f);
    e.light.albedo_anchor = "reference_albedo";
    ObjectEstimate glass;
    glass.id = "object_0";
    glass.object_class = ObjectClass::Transparent;
    glass.class_margin = 1.1;
    glass.mesh_file = "20_candidates/object_0.ply";
    glass.ior = {1.5, 0.01, 0.02, Outcome::AtBound, "the best index lies at the end of the range"};
    glass.sigma_a_per_m = {Rgb(1, 0.5f, 2), Rgb(0.1f, 0.1f, 0.1f), 0.02, Outcome::Converged, ""};
    ObjectEstimate metal;
    metal.id = "object_1";
    metal.object_class = ObjectClass::Specular;
    metal.class_margin = -1.0;
    WardCluster cluster;
    cluster.fit.ward.rho_d = Rgb(0.2f, 0.1f, 0.1f);
    cluster.fit.ward.sigma_x = cluster.fit.ward.sigma_y = cluster.fit.sigma.value = 0.12;
    cluster.fit.ward.form = WardForm::Duer;
    cluster.fit.sigma.outcome = Outcome::Converged;
    metal.clusters = {cluster};
    e.objects = {glass, metal};
    e.error_initial = 0.02;
    e.error_joint = 0.01;
    return e;
}

TEST(Estimate, StartsAtZeroWhateverTheMemoryHeld) {
    alignas(Estimate<Rgb>) std::array<unsigned char, sizeof(Estimate<Rgb>)> memory;
    memory.fill(0x7f);
    auto* estimate = new (memory.data()) Estimate<Rgb>;
    EXPECT_TRUE((estimate->value == 0.0f).all());
    EXPECT_TRUE((estimate->stddev == 0.0f).all());
    EXPECT_EQ(estimate->outcome, Outcome::NotIdentifiable);
    std::destroy_at(estimate);
}

TEST(EstimateJson, RoundTrip) {
    const SceneEstimate written = example();
    const std::filesystem::path path = scratch("estimate.json");
    write_estimate(path, written);
    const SceneEstimate e = read_estimate(path);
    ASSERT_EQ(e.light.lights.size(), 1u);
    EXPECT_EQ(e.light.lights[0].light.position_m, written.light.lights[0].light.position_m);
    EXPECT_EQ(e.light.lights[0].stddev_direction_deg, 0.6);
    EXPECT_TRUE((e.light.ambient_radiance == written.light.ambient_radiance).all());
    ASSERT_EQ(e.objects.size(), 2u);
    EXPECT_EQ(e.objects[0].ior.value, 1.5);
    EXPECT_EQ(e.objects[0].ior.outcome, Outcome::AtBound);
    EXPECT_EQ(e.objects[0].ior.reason, written.objects[0].ior.reason);
    EXPECT_EQ(e.objects[1].object_class, ObjectClass::Specular);
    EXPECT_EQ(e.objects[1].clusters.at(0).fit.ward.form, WardForm::Duer);
    EXPECT_EQ(e.objects[1].clusters.at(0).fit.ward.sigma_y, 0.12);
    EXPECT_EQ(e.error_joint, 0.01);
    EXPECT_FALSE(e.is_complete());  // the index is at its bound
}

TEST(EstimateJson, OverridesAreReadAndJudged) {
    const std::filesystem::path path = scratch("overrides.json");
    write_text_file(path, R"({"objects": [{"id": "object_0", "class": "transparent", "ior": 1.5,
                               "sigma_a_per_m": [1, 2, 3], "ignore": false}],
        "lights": [{"kind": "point", "position_m": [0, 0, 1], "intensity_w_per_sr": [1, 1, 1]}]})");
    const Overrides o = read_overrides(path);
    ASSERT_EQ(o.objects.size(), 1u);
    EXPECT_EQ(o.objects[0].object_class, ObjectClass::Transparent);
    EXPECT_EQ(o.objects[0].ior, 1.5);
    EXPECT_EQ(o.lights.size(), 1u);
    write_text_file(path, R"({"objects": [{"id": "a", "clas": "transparent"}]})");
    EXPECT_THROW(read_overrides(path), InputError);
    write_text_file(path, R"({"objects": [{"id": "a", "ior": 0.2}]})");
    EXPECT_THROW(read_overrides(path), InputError);
}

}  // namespace
}  // namespace vitrine
