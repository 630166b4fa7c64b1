#include "synthetic/world.h"

#include "geometry/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

WorldOptions tiny() {
    WorldOptions options;
    options.view_count = 3;
    options.width = 60;
    options.height = 45;
    options.samples_per_pixel = 4;
    options.photon_count = 20'000;
    return options;
}

TEST(World, FollowsFromItsSeed) {
    const World a = make_world(tiny()), b = make_world(tiny());
    WorldOptions other = tiny();
    other.seed = 1;
    const World c = make_world(other);
    EXPECT_EQ(a.lights[0].position_m, b.lights[0].position_m);
    EXPECT_NE(a.lights[0].position_m, c.lights[0].position_m);
    for (std::size_t i = 0; i < a.capture.frames[0].colour.size(); ++i)
        ASSERT_TRUE((a.capture.frames[0].colour[i] == b.capture.frames[0].colour[i]).all());
}

TEST(World, IsLitClosedAndHandsOverNoTruth) {
    const World world = make_world(tiny());
    ASSERT_EQ(world.labelled.parts.size(), 2u);
    EXPECT_TRUE(world.labelled.lights.empty());
    EXPECT_TRUE(std::holds_alternative<Diffuse>(world.labelled.parts[1].material));
    EXPECT_TRUE(find_defects(*world.truth.parts[1].mesh).is_closed());
    double sum = 0;
    for (const Rgb& pixel : world.capture.frames[0].colour) {
        ASSERT_TRUE(pixel.allFinite());
        sum += luminance(pixel);
    }
    EXPECT_GT(sum / static_cast<double>(world.capture.frames[0].colour.size()), 0.02);
}

TEST(World, AVesselIsHollowItsHullSolid) {
    WorldOptions options = tiny();
    options.object = WorldObject::Vessel;
    const World world = make_world(options);
    const Mesh& glass = *world.truth.parts[1].mesh;
    const Mesh& hull = *world.labelled.parts[1].mesh;
    EXPECT_TRUE(find_defects(glass).is_closed());
    EXPECT_TRUE(find_defects(hull).is_closed());
    EXPECT_GT(world.wall_m, 0.001);
    EXPECT_LT(volume(glass), 0.6 * volume(hull));
    EXPECT_GT(volume(glass), 0.0);
}

TEST(World, GeometryIsAsFarOffAsAsked) {
    WorldOptions options = tiny();
    options.shape = WorldShape::Pebble;
    options.hull_error_m = 0.001;
    options.scan_error_m = 0.002;
    options.pose_error_m = 0.003;
    const World world = make_world(options);
    EXPECT_TRUE(find_defects(*world.labelled.parts[1].mesh).is_closed());
    // Triangles keep their order where creases split vertices anew.
    const Mesh& truth = *world.truth.parts[1].mesh;
    const Mesh& hull = *world.labelled.parts[1].mesh;
    ASSERT_EQ(truth.triangles.size(), hull.triangles.size());
    double square = 0.0;
    for (std::size_t t = 0; t < truth.triangles.size(); ++t) {
        const Vec3f& a = truth.vertices[static_cast<std::size_t>(truth.triangles[t][0])];
        const Vec3f& b = hull.vertices[static_cast<std::size_t>(hull.triangles[t][0])];
        square += static_cast<double>((a - b).squaredNorm());
    }
    EXPECT_NEAR(std::sqrt(square / static_cast<double>(truth.triangles.size())), 0.001, 4e-4);
    double shift = 0.0;
    for (std::size_t k = 0; k < world.truth.cameras.size(); ++k)
        shift = std::max(shift, (world.truth.cameras[k].centre_in_world() -
                                 world.labelled.cameras[k].centre_in_world())
                                    .norm());
    EXPECT_GT(shift, 0.0005);
    EXPECT_LT(shift, 0.02);
}

TEST(World, TheSunShinesFromFarAway) {
    WorldOptions options = tiny();
    options.is_sunny = true;
    const World world = make_world(options);
    ASSERT_EQ(world.truth.lights.size(), 1u);
    const auto& sun = std::get<DirectionalLight>(world.truth.lights[0]);
    EXPECT_GT(world.lights[0].position_m.norm(), 100.0);
    EXPECT_LT((sun.direction + world.lights[0].position_m.normalized()).norm(), 1e-9);
}

}  // namespace
}  // namespace vitrine
