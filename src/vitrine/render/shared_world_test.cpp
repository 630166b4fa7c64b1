// Virtual parts beside a world that is kept: the same pictures as if all were built together.
#include "geometry/primitives.h"
#include "render/differential.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

Part make_part(const Mesh& mesh, const Material& material) {
    return {"part", std::make_shared<Mesh>(mesh), material, "", false};
}

Scene table_with_ball() {
    Scene scene;
    scene.parts.push_back(make_part(make_plane(1.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false}));
    scene.parts.push_back(
        make_part(make_sphere(0.05, Vec3(0, 0, 0.055), 32), Dielectric{1.5, Rgb(3, 1, 2)}));
    scene.lights.push_back(PointLight{Vec3(0.3, 0.2, 0.6), Rgb::Constant(1.0f)});
    Camera camera{"c", 64, 48, 80, 80, 31.5, 23.5, {}};
    camera.cam_from_world =
        look_at(Vec3(-0.4, -0.3, 0.4), Vec3(-0.02, 0, 0.03), Vec3(0, 0, 1)).inverse();
    scene.cameras.push_back(camera);
    return scene;
}

double mean_difference(const ImageRgb& a, const ImageRgb& b) {
    double difference = 0, sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        difference += (a[i] - b[i]).abs().sum();
        sum += b[i].abs().sum();
    }
    return difference / sum;
}

TEST(SharedWorld, SamePicturesAsBuiltTogether) {
    const Scene scene = table_with_ball();
    const RenderScene world(scene);
    const Mesh box = make_box(Vec3(0.04, 0.04, 0.04), Vec3(-0.08, -0.02, 0.02));
    DifferentialOptions options = preview_options();
    options.photon_count = 20'000;
    for (const Material& material : {Material(Diffuse{Rgb::Constant(0.7f), {}, {}, false}),
                                     Material(Dielectric{1.4, Rgb::Constant(5.0f)})}) {
        const DifferentialRenderer together(scene, {make_part(box, material)}, scene.cameras,
                                            options);
        const DifferentialRenderer beside(world, {make_part(box, material)}, scene.cameras,
                                          options);
        const DifferentialImage a = together.render(scene.cameras[0]);
        const DifferentialImage b = beside.render(scene.cameras[0]);
        // Single rays along edges may fall to either side.
        EXPECT_LT(mean_difference(b.with, a.with), 0.01);
        EXPECT_LT(mean_difference(b.without, a.without), 0.01);
        EXPECT_LT(mean_difference(b.object, a.object), 0.02);
        EXPECT_NEAR(beside.photon_balance().stored, together.photon_balance().stored,
                    0.005 * together.photon_balance().stored);
    }
    // The kept world is as it was.
    EXPECT_EQ(world.scene().parts.size(), 2u);
    EXPECT_FALSE(world.has_virtual());
}

TEST(SharedWorld, RaysMeetTheNearestOfBoth) {
    const RenderScene world(table_with_ball());
    const Part box = make_part(make_box(Vec3(0.02, 0.02, 0.02), Vec3(0.2, 0, 0.2)),
                               Diffuse{Rgb::Constant(0.7f), {}, {}, false});
    const RenderScene both(world, {box});
    const Ray down{Vec3f(0.2f, 0, 0.5f), Vec3f(0, 0, -1), 0.0f, 1e30f, kAllParts};
    EXPECT_EQ(both.closest(down).part, 2);
    EXPECT_NEAR(both.closest(down).distance, 0.29f, 1e-5f);
    Ray real = down;
    real.mask = kRealParts;
    EXPECT_EQ(both.closest(real).part, 0);
    const Ray up{Vec3f(0.2f, 0, 0.05f), Vec3f(0, 0, 1), 0.0f, 1e30f, kAllParts};
    EXPECT_TRUE(both.is_occluded(up));
    EXPECT_FALSE(world.is_occluded(up));
    // Rays of both scenes in one list: each has its own mask.
    std::vector<BareRay> mixed;
    for (int i = 0; i < 12; ++i)
        mixed.emplace_back(up.origin, up.direction, 1e30f, i % 3 ? kRealParts : kAllParts);
    both.occluded(mixed);
    for (std::size_t i = 0; i < mixed.size(); ++i) EXPECT_EQ(mixed[i].is_hidden(), i % 3 == 0) << i;
    EXPECT_EQ(both.nearest(Vec3f(0.2f, 0, 0.22f), 0.05f).part, 2);
    EXPECT_EQ(both.nearest(Vec3f(0.2f, 0, 0.01f), 0.05f).part, 0);
}

}  // namespace
}  // namespace vitrine
