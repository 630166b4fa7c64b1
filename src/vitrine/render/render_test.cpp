#include "geometry/primitives.h"
#include "render/render_image.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

Part make_part(const Mesh& mesh, const Material& material) {
    return {"part", std::make_shared<Mesh>(mesh), material, "", false};
}

Camera small_camera(const Vec3& eye, const Vec3& target, int size, double f) {
    Camera camera{"c", size, size, f, f, 0.5 * (size - 1), 0.5 * (size - 1), {}};
    camera.cam_from_world = look_at(eye, target, Vec3(0, 0, 1)).inverse();
    return camera;
}

double mean_radiance(const ImageRgb& image) {
    double sum = 0;
    for (const Rgb& p : image) sum += luminance(p);
    return sum / static_cast<double>(image.size());
}

// A point light of pi W/sr in the centre of a sphere of radius 1, albedo a: E = pi everywhere,
// plus all bounces: L = a / (1 - a).
TEST(PathTracer, InsideOfASphere) {
    Scene scene;
    scene.parts.push_back(
        make_part(make_sphere(1.0, Vec3::Zero(), 64), Diffuse{Rgb::Constant(0.5f), {}, {}, false}));
    scene.lights.push_back(PointLight{Vec3::Zero(), Rgb::Constant(kPif)});
    const RenderScene prepared(scene);
    FinalOptions options;
    options.use_photons = false;
    options.samples_per_pixel = 64;
    options.paths.max_diffuse_bounces = 20;
    const auto image =
        render_image(prepared, small_camera(Vec3(0.2, 0.1, 0), Vec3(1, 0, 0.1), 10, 8), options);
    EXPECT_NEAR(mean_radiance(image.radiance), 1.0, 0.01);
}

// Albedo a within a uniform environment: the furnace returns a exactly for a convex body.
TEST(PathTracer, ConvexBodyInAFurnace) {
    for (const float albedo : {0.3f, 0.8f}) {
        Scene scene;
        scene.parts.push_back(make_part(make_sphere(0.1, Vec3::Zero(), 48),
                                        Diffuse{Rgb::Constant(albedo), {}, {}, false}));
        scene.ambient_radiance = Rgb::Constant(1.0f);
        FinalOptions options;
        options.samples_per_pixel = 16;
        const auto image = render_image(RenderScene(scene),
                                        small_camera(Vec3(1, 0, 0), Vec3::Zero(), 8, 60), options);
        EXPECT_NEAR(mean_radiance(image.radiance), albedo, 0.002);
    }
}

// Clear glass in a uniform environment is invisible: all that is lost is reflected.
TEST(PathTracer, ClearGlassVanishesInAFurnace) {
    Scene scene;
    scene.parts.push_back(
        make_part(make_sphere(0.1, Vec3::Zero(), 48), Dielectric{1.5, Rgb::Zero()}));
    scene.ambient_radiance = Rgb::Constant(1.0f);
    FinalOptions options;
    options.samples_per_pixel = 16;
    options.paths.max_specular_bounces = 64;
    const auto image =
        render_image(RenderScene(scene), small_camera(Vec3(1, 0, 0), Vec3::Zero(), 8, 30), options);
    EXPECT_NEAR(mean_radiance(image.radiance), 1.0, 0.002);
}

}  // namespace
}  // namespace vitrine
