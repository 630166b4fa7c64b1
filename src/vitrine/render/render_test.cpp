#include "geometry/primitives.h"
#include "render/render_image.h"
#include "render/sample_plan.h"

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
// plus all bounces, 1 / (1 - a) times that: L = a / (1 - a).
TEST(PathTracer, InsideOfASphere) {
    Scene scene;
    const Rgb albedo(0.2f, 0.5f, 0.8f);
    scene.parts.push_back(
        make_part(make_sphere(1.0, Vec3::Zero(), 64), Diffuse{albedo, {}, {}, false}));
    scene.lights.push_back(PointLight{Vec3::Zero(), Rgb::Constant(kPif)});
    const RenderScene prepared(scene);
    FinalOptions options;
    options.use_photons = false;
    options.samples_per_pixel = 64;
    options.paths.max_diffuse_bounces = 60;
    const auto image =
        render_image(prepared, small_camera(Vec3(0.2, 0.1, 0), Vec3(1, 0, 0.1), 10, 8), options);
    Rgb mean = Rgb::Zero();
    for (const Rgb& p : image.radiance) mean += p / static_cast<float>(image.radiance.size());
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(mean[c] / (albedo[c] / (1 - albedo[c])), 1.0, 0.01) << c;
    }
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

// The same under an environment map that is uniform, found by sampling it and by chance.
TEST(PathTracer, UniformEnvironmentMapIsAFurnace) {
    Scene scene;
    scene.parts.push_back(
        make_part(make_sphere(0.1, Vec3::Zero(), 48), Diffuse{Rgb::Constant(0.7f), {}, {}, false}));
    scene.lights.push_back(
        EnvironmentLight{std::make_shared<ImageRgb>(16, 8, Rgb::Constant(2.0f)), "", 0.5});
    FinalOptions options;
    options.samples_per_pixel = 64;
    const auto image =
        render_image(RenderScene(scene), small_camera(Vec3(1, 0, 0), Vec3::Zero(), 8, 60), options);
    EXPECT_NEAR(mean_radiance(image.radiance), 0.7, 0.004);
}

// Noise is evened out: where the lamp's penumbra is, more paths; nowhere less than asked for.
TEST(RenderImage, NoisyPixelsGetMoreSamples) {
    Scene scene;
    scene.parts.push_back(make_part(make_plane(1.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false}));
    scene.parts.push_back(make_part(make_box(Vec3(0.2, 0.2, 0.2), Vec3(0, 0, 0.2)),
                                    Diffuse{Rgb::Zero(), {}, {}, false}));
    scene.lights.push_back(DiscLight{Vec3(0, 0, 1), Vec3(0, 0, -1), 0.2, Rgb::Constant(1.0f)});
    const RenderScene prepared(scene);
    const Camera camera = small_camera(Vec3(0, -1, 0.6), Vec3(0, 0, 0), 24, 40);
    FinalOptions options;
    options.use_photons = false;
    options.samples_per_pixel = 16;
    options.noise_target = 0.02;
    // Root mean square over the pixels of the relative standard error.
    const auto noise = [&](int max_samples) {
        options.max_samples_per_pixel = max_samples;
        const RenderedImage image = render_image(prepared, camera, options);
        const double mean = mean_radiance(image.radiance);
        double sum = 0;
        for (std::size_t i = 0; i < image.radiance.size(); ++i) {
            const double level = std::hypot(luminance(image.radiance[i]), 0.1 * mean);
            sum += image.variance[i] / (level * level);
        }
        return std::sqrt(sum / static_cast<double>(image.radiance.size()));
    };
    const double plain = noise(0), adaptive = noise(1024);
    EXPECT_GT(plain, 0.02);
    EXPECT_LT(adaptive, 0.5 * plain);
}

TEST(RenderImage, GivenSamplesAreThoseOfAnEvenPictureWithAsMany) {
    Scene scene;
    scene.parts.push_back(make_part(make_plane(1.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false}));
    scene.lights.push_back(DiscLight{Vec3(0, 0, 1), Vec3(0, 0, -1), 0.2, Rgb::Constant(1.0f)});
    const RenderScene prepared(scene);
    const Camera camera = small_camera(Vec3(0, -1, 0.6), Vec3(0, 0, 0), 8, 40);
    FinalOptions options;
    options.use_photons = false;
    options.samples_per_pixel = 4;
    const ImageRgb few = render_image(prepared, camera, options).radiance;
    options.samples_per_pixel = 32;
    const ImageRgb many = render_image(prepared, camera, options).radiance;
    Image<int> samples(8, 8, 4);
    samples(3, 5) = 32;
    options.samples = &samples;
    const ImageRgb mixed = render_image(prepared, camera, options).radiance;
    EXPECT_TRUE((mixed(3, 5) == many(3, 5)).all());
    EXPECT_TRUE((mixed(4, 5) == few(4, 5)).all());
    EXPECT_FALSE((many(4, 5) == few(4, 5)).all());
}

TEST(SamplePlan, SamplesFollowTheVariance) {
    ImageF variance(9, 1, 1.0f), target(9, 1, 1.0f);
    const Image<int> count(9, 1, 8);
    for (int x = 5; x < 9; ++x) variance(x, 0) = 4.0f;
    const Image<int> plan = plan_samples(variance, count, target, 1000, 5);
    EXPECT_EQ(plan(0, 0), 10);  // 8, rounded up to a multiple of 5
    EXPECT_EQ(plan(8, 0), 35);  // 32
    EXPECT_EQ(plan_samples(variance, count, target, 20)(8, 0), 20);
    EXPECT_EQ(plan_samples(variance, count, target, 4)(8, 0), 8);  // what is done is done
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

TEST(PathSampler, PlacesAndDirectionsAreSpreadTogether) {
    // Sobol's first four dimensions are a (3, 11, 4)-net: eight of 2^11 points in each of 4^4
    // boxes.
    std::vector<int> count(256, 0);
    for (std::uint32_t i = 0; i < 2048; ++i) {
        const PathSampler sampler(77, i);
        const Vec2f a = sampler.pair(0, 0), b = sampler.further_pair(0);
        std::size_t box = 0;
        for (const float u : {a.x(), a.y(), b.x(), b.y()}) {
            box = 4 * box + static_cast<std::size_t>(4 * u);
        }
        ++count[box];
    }
    for (const int n : count) EXPECT_EQ(n, 8);
}

}  // namespace
}  // namespace vitrine
