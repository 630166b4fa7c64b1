#include "trace/accel.h"

#include "base/rng.h"
#include "geometry/primitives.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

Accel sphere_and_plane() {
    return Accel({{std::make_shared<Mesh>(make_sphere(0.5, Vec3(0, 0, 0.5), 64)), 1u},
                  {std::make_shared<Mesh>(make_plane(4)), 2u}});
}

TEST(Accel, ClosestHitOfSphereAndPlane) {
    const Accel accel = sphere_and_plane();
    const Hit top = accel.closest({Vec3f(0.01f, 0.02f, 5), Vec3f(0, 0, -1)});
    ASSERT_EQ(top.part, 0);
    EXPECT_NEAR(top.distance, 4.0f, 2e-3f);
    const Mesh& sphere = *accel.parts()[0].mesh;
    EXPECT_GT(shading_normal(sphere, top).z(), 0.998f);
    EXPECT_NEAR(hit_point(sphere, top).x(), 0.01f, 1e-5f);
    EXPECT_EQ(accel.closest({Vec3f(1, 1, 5), Vec3f(0, 0, -1)}).part, 1);
    EXPECT_FALSE(accel.closest({Vec3f(9, 9, 5), Vec3f(0, 0, -1)}).is_hit());
}

TEST(Accel, MasksHideParts) {
    const Accel accel = sphere_and_plane();
    EXPECT_EQ(accel.closest({Vec3f(0, 0.01f, 5), Vec3f(0, 0, -1), 0, 1e30f, 2u}).part, 1);
    EXPECT_FALSE(accel.is_occluded({Vec3f(0, 0.01f, 5), Vec3f(0, 0, -1), 0, 4.9f, 2u}));
    EXPECT_TRUE(accel.is_occluded({Vec3f(0, 0.01f, 5), Vec3f(0, 0, -1), 0, 4.9f, 1u}));
}

TEST(Accel, OcclusionAgreesWithClosestHit) {
    const Accel accel = sphere_and_plane();
    Rng rng(3);
    std::vector<Ray> rays;
    for (int i = 0; i < 2000; ++i) {
        const auto u = [&] { return 4 * rng.next_float() - 2; };
        rays.push_back({Vec3f(u(), u(), u() + 2.5f), Vec3f(u(), u(), u()), 1e-4f, 1.0f});
    }
    std::vector<std::uint8_t> batch;
    accel.occluded(rays, batch);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const bool hit = accel.closest(rays[i]).is_hit();
        EXPECT_EQ(accel.is_occluded(rays[i]), hit);
        EXPECT_EQ(batch[i] != 0, hit);
    }
}

TEST(Accel, NearestPointOnSphereAndPlane) {
    const Accel accel = sphere_and_plane();
    const Hit side = accel.nearest(Vec3f(0.8f, 0, 0.5f), 1.0f);
    ASSERT_EQ(side.part, 0);
    EXPECT_NEAR(side.distance, 0.3f, 1e-3f);
    EXPECT_GT(side.normal.x(), 0.99f);
    const Hit below = accel.nearest(Vec3f(1.3f, 0.4f, -0.2f), 1.0f);
    ASSERT_EQ(below.part, 1);
    EXPECT_NEAR(below.distance, 0.2f, 1e-5f);
    EXPECT_NEAR(hit_point(*accel.parts()[1].mesh, below).x(), 1.3f, 1e-5f);
    EXPECT_FALSE(accel.nearest(Vec3f(0, 0, 3), 1.0f).is_hit());
}

}  // namespace
}  // namespace vitrine
