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

/// Any way through the scene; half of them see the sphere alone.
std::vector<Ray> random_rays() {
    Rng rng(3);
    std::vector<Ray> rays;
    for (int i = 0; i < 2000; ++i) {
        const auto u = [&] { return 4 * rng.next_float() - 2; };
        rays.push_back(
            {Vec3f(u(), u(), u() + 2.5f), Vec3f(u(), u(), u()), 1e-4f, 1.0f, i % 2 == 0 ? 3u : 1u});
    }
    return rays;
}

TEST(Accel, OcclusionAgreesWithClosestHit) {
    const Accel accel = sphere_and_plane();
    const std::vector<Ray> rays = random_rays();
    std::vector<BareRay> list;
    for (const Ray& ray : rays) {
        list.emplace_back(ray.origin, ray.direction, ray.max_distance, ray.mask);
        list.back().min_distance = ray.min_distance;
    }
    accel.occluded(list);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const bool hit = accel.closest(rays[i]).is_hit();
        EXPECT_EQ(accel.is_occluded(rays[i]), hit);
        EXPECT_EQ(list[i].is_hidden(), hit);
    }
}

TEST(Accel, ListsAreAnsweredAsSingleRays) {
    const Accel accel = sphere_and_plane();
    const std::vector<Ray> rays = random_rays();
    int hits = 0;
    for (const bool are_alike : {false, true}) {
        std::vector<RayAndHit> list;
        for (const Ray& ray : rays) list.emplace_back(ray.origin, ray.direction, ray.mask);
        accel.closest(std::span(list), are_alike);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const Hit alone =
                accel.closest({rays[i].origin, rays[i].direction, 0.0f, 1e30f, rays[i].mask});
            const Hit hit = hit_of(list[i]);
            ASSERT_EQ(hit.part, alone.part);
            if (!alone.is_hit()) continue;
            ++hits;
            EXPECT_EQ(hit.triangle, alone.triangle);
            EXPECT_NEAR(hit.distance, alone.distance, 1e-5f);
            EXPECT_NEAR((hit.normal - alone.normal).norm(), 0, 1e-6f);
            EXPECT_NEAR((hit.barycentric - alone.barycentric).norm(), 0, 1e-4f);
        }
    }
    EXPECT_GT(hits, 200);
}

TEST(Accel, RaysOfItemsAreAnsweredInPlace) {
    struct Item {
        RayAndHit ray;
        std::int64_t number[3];
    };
    const Accel accel = sphere_and_plane();
    std::vector<RayAndHit> list;
    std::vector<Item> items;
    for (const Ray& ray : random_rays()) {
        list.emplace_back(ray.origin, ray.direction, ray.mask);
        items.push_back({list.back(), {7, 8, 9}});
    }
    for (const bool are_alike : {false, true}) {
        for (std::size_t i = 0; i < items.size(); ++i) items[i].ray = list[i];
        std::vector<RayAndHit> apart = list;
        accel.closest(std::span(apart), are_alike);
        accel.closest(RayList::of(std::span(items)), are_alike);
        for (std::size_t i = 0; i < items.size(); ++i) {
            ASSERT_EQ(items[i].ray.part, apart[i].part);
            EXPECT_EQ(items[i].ray.distance(), apart[i].distance());
            EXPECT_EQ(items[i].number[0] + items[i].number[1] + items[i].number[2], 24);
        }
    }
    accel.closest(RayList::of(std::span<Item>()), true);
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
