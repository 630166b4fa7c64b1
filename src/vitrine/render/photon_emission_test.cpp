// Photons that leave a light side by side are bit by bit those that leave it alone.
#include "render/photon_emission.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "geometry/primitives.h"
#include "render/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace vitrine {
namespace {

Scene ball_and_lights() {
    Scene scene;
    scene.parts.push_back({"ball", std::make_shared<Mesh>(make_sphere(0.1, Vec3(0, 0, 0.1), 12)),
                           Dielectric{1.5, Rgb::Zero()}, "", false});
    const Vec3 down(0.1, -0.2, -1);
    auto map = std::make_shared<ImageRgb>(4, 2);
    for (std::size_t i = 0; i < map->size(); ++i) (*map)[i] = Rgb::Constant(float(i + 1));
    scene.lights.push_back(PointLight{Vec3(0.3, 0.2, 0.7), Rgb(1, 2, 3)});
    scene.lights.push_back(DiscLight{Vec3(-0.3, 0.1, 0.6), down.normalized(), 0.1, Rgb(3, 2, 1)});
    // So large and near that some of its points lie in the sphere around the ball.
    scene.lights.push_back(DiscLight{Vec3(0, 0, 0.15), down.normalized(), 0.2, Rgb(3, 2, 1)});
    scene.lights.push_back(SpotLight{Vec3(0.1, 0.1, 0.9), down.normalized(), Rgb(1, 1, 2), 50.0});
    scene.lights.push_back(DirectionalLight{down.normalized(), Rgb(2, 1, 1)});
    scene.lights.push_back(EnvironmentLight{map, "", 1.0});
    return scene;
}

TEST(PhotonEmission, LanesAreTheRaysOfTheLights) {
    const RenderScene scene(ball_and_lights());
    CausticOptions options;
    options.photon_count = 1000;
    options.seed = 4;
    const std::vector<PhotonTarget> targets = find_targets(scene, options);
    ASSERT_EQ(targets.size(), scene.scene().lights.size());
    std::size_t dark = 0;
    for (const PhotonTarget& target : targets) {
        std::vector<std::uint32_t> indices(61);  // no multiple of a step
        std::iota(indices.begin(), indices.end(), 77u);
        EmittedLanes photons = {};
        PhotonEmission(scene, target).emit(indices, photons);
        for (std::size_t i = 0; i < indices.size(); ++i) {
            const PathSampler sampler(target.key, indices[i]);
            const EmittedRay ray =
                scene.lights().emit(target.light, target.sphere, sampler.pair(0, 0),
                                    sampler.further_pair(0), scene.bounding_sphere());
            const auto k = static_cast<int>(i);
            EXPECT_EQ(photons.origin.at(k), ray.origin) << target.light;
            EXPECT_EQ(photons.direction.at(k), ray.direction) << target.light;
            const Rgb power = ray.power / static_cast<float>(target.count);
            EXPECT_TRUE((photons.power.at(k).array() == power).all()) << target.light;
            dark += power.maxCoeff() > 0 ? 0 : 1;
        }
    }
    EXPECT_GT(dark, 5u);
}

TEST(PhotonEmission, OrderHoldsEachPhotonOnceAndKeepsNeighboursTogether) {
    PhotonTarget target;
    target.key = 3;
    constexpr std::size_t kFirst = 100, kCount = 20000;
    std::vector<std::uint32_t> order = coherent_order(target, kFirst, kCount);
    const auto place = [&](std::uint32_t index) { return PathSampler(3, index).pair(0, 0); };
    double step = 0;
    for (std::size_t k = 1; k < order.size(); ++k) {
        step += double((place(order[k]) - place(order[k - 1])).norm()) / double(kCount);
    }
    EXPECT_LT(step, 2.5 / std::sqrt(double(kCount)));  // a few times the mean distance
    for (const int threads : {2, 8}) {
        set_thread_count(threads);
        EXPECT_EQ(coherent_order(target, kFirst, kCount), order);
    }
    set_thread_count(0);
    std::sort(order.begin(), order.end());
    for (std::size_t k = 0; k < kCount; ++k) EXPECT_EQ(order[k], kFirst + k);
}

}  // namespace
}  // namespace vitrine
