#include "render/hemisphere_photons.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "geometry/primitives.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace vitrine {
namespace {

Scene table_with_box() {
    Mesh scan = make_plane(1.0, 0.0, 20);
    append(scan, make_box(Vec3(0.1, 0.1, 0.1), Vec3(0.2, 0.0, 0.05)));
    Part part;
    part.name = "scan";
    part.mesh = std::make_shared<const Mesh>(scan);
    Scene scene;
    scene.parts.push_back(part);
    return scene;
}

TEST(PhotonTree, FindsWhatAFullSearchFinds) {
    Rng rng(3);
    std::vector<PhotonHit> photons(700);
    for (PhotonHit& p : photons) {
        p.position = Vec3f(rng.next_float(), rng.next_float(), 0.1f * rng.next_float());
        p.direction = Vec3f(0, 0, rng.next_float() < 0.8f ? -1.0f : 1.0f);
    }
    const PhotonTree tree(photons);
    for (int k = 0; k < 50; ++k) {
        const SurfacePoint at{Vec3f(rng.next_float(), rng.next_float(), 0), Vec3f(0, 0, 1)};
        std::vector<float> all;
        for (const PhotonHit& p : photons)
            if (p.direction.z() < 0) all.push_back((p.position - at.position).squaredNorm());
        std::sort(all.begin(), all.end());
        const PhotonTree::Gathered found = tree.nearest(at, 20);
        EXPECT_EQ(found.count, 20);
        EXPECT_FLOAT_EQ(found.distance2, all[19]);
    }
    EXPECT_EQ(PhotonTree({}).nearest({}, 5).count, 0);
}

TEST(HemispherePhotons, DensityIsTheIrradianceOfAnOpenTable) {
    const Scene scene = table_with_box();
    const EstimationScene world(scene);
    const Vec3 light(-0.3, 0.2, 0.8);
    HemispherePhotonOptions options;
    options.photon_count = 400'000;
    options.albedo = 0.0f;  // direct light only: known in closed form
    const PhotonTree tree(trace_hemisphere_photons(world, light, -light.normalized(), options));
    std::vector<SurfacePoint> points;
    // Apart by more than a neighbourhood of 200 photons, so that their noise is averaged out, and
    // on the lamp's side of the box.
    for (int k = 0; k < 144; ++k)
        points.push_back({Vec3f(-0.42f + 0.03f * static_cast<float>(k % 12),
                                -0.42f + 0.075f * static_cast<float>(k / 12), 0),
                          Vec3f(0, 0, 1)});
    const std::vector<float> e = photon_irradiance(tree, points, options.photon_count, 200);
    double ratio = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 d = light - points[i].position.cast<double>();
        const double exact = d.z() / std::pow(d.norm(), 3);
        EXPECT_NEAR(e[i] / exact, 1.0, 0.3);  // 1 / sqrt(200) = 7 %
        ratio += e[i] / exact / static_cast<double>(points.size());
    }
    EXPECT_NEAR(ratio, 1.0, 0.03);
}

TEST(HemispherePhotons, SameOnAnyNumberOfThreads) {
    const Scene scene = table_with_box();
    const EstimationScene world(scene);
    HemispherePhotonOptions options;
    options.photon_count = 40'000;
    const auto trace = [&] {
        return trace_hemisphere_photons(world, Vec3(0, 0, 1), Vec3(0, 0, -1), options);
    };
    const std::vector<PhotonHit> many = trace();
    set_thread_count(1);
    const std::vector<PhotonHit> one = trace();
    set_thread_count(0);
    ASSERT_EQ(many.size(), one.size());
    for (std::size_t i = 0; i < one.size(); ++i) ASSERT_EQ(many[i].position, one[i].position);
}

}  // namespace
}  // namespace vitrine
