#include "render/caustics.h"

#include "base/parallel.h"
#include "geometry/primitives.h"
#include "math/statistics.h"
#include "optics/fresnel.h"
#include "render/differential.h"

#include <gtest/gtest.h>

#include <cstring>

namespace vitrine {
namespace {

void add(Scene& scene, const Mesh& mesh, const Material& material) {
    scene.parts.push_back({"part", std::make_shared<Mesh>(mesh), material, "", false});
}

Camera camera_at(const Vec3& eye, const Vec3& target, int width, int height, double f) {
    Camera camera{"c", width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1), {}};
    camera.cam_from_world = look_at(eye, target, Vec3(0, 0, 1)).inverse();
    return camera;
}

Scene ball_on_table(double light_radius_m) {
    Scene scene;
    add(scene, make_plane(1.0), Diffuse{Rgb(0.6f, 0.5f, 0.4f), {}, {}, false});
    add(scene, make_sphere(0.05, Vec3(0, 0, 0.055), 48), Dielectric{1.5, Rgb(3, 1, 2)});
    scene.lights.push_back(DiscLight{Vec3(0.3, 0.2, 0.6), Vec3(-0.3, -0.2, -0.55).normalized(),
                                     light_radius_m, Rgb::Constant(2.0f)});
    return scene;
}

TEST(Caustics, PowerInIsPowerOut) {
    CausticOptions options;
    options.photon_count = 20000;
    const PhotonBalance b = trace_caustics(RenderScene(ball_on_table(0.05)), options).balance;
    EXPECT_NEAR(b.emitted, b.stored + b.escaped + b.absorbed + b.ended + b.chance,
                1e-4 * b.emitted);
    EXPECT_LT(std::abs(b.chance), 0.003 * b.emitted);
    EXPECT_LT(b.ended, 0.001 * b.emitted);
    EXPECT_GT(b.stored, 0.7 * b.emitted);
    EXPECT_GT(static_cast<double>(b.met), 0.99 * static_cast<double>(b.shot));
}

// A plate between sun and table: first-order theory with all internal reflections,
// T = (1 - R) exp(-a s) (1 - R) / (1 - R^2 exp(-2 a s)).
TEST(Caustics, PlateTransmitsWithAllItsReflections) {
    Scene scene;
    const double thickness = 0.01, sigma = 20.0;
    add(scene, make_plane(4.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false});
    add(scene, make_box(Vec3(1, 1, thickness), Vec3(0, 0, 0.3)),
        Dielectric{1.5, Rgb::Constant(static_cast<float>(sigma))});
    scene.lights.push_back(DirectionalLight{Vec3(0.5, 0, -std::sqrt(0.75)), Rgb::Constant(1.0f)});
    CausticOptions options;
    options.photon_count = 200000;
    const CausticPhotons result = trace_caustics(RenderScene(scene), options);
    double through = 0;  // irradiance in the middle of the plate's shadow
    // The window keeps clear of light that came through the plate's sides.
    const double x0 = 0.3 * std::tan(kPi / 6), half = 0.15;
    for (const Photon& p : result.photons) {
        if (std::abs(p.position.x() - x0) < half && std::abs(p.position.y()) < half) {
            through += p.power[0] / (4 * half * half);
        }
    }
    double cos_t;
    const double r = fresnel_dielectric(std::sqrt(0.75), 1.5, cos_t);
    const double a = std::exp(-sigma * thickness / cos_t);
    const double expected = std::sqrt(0.75) * (1 - r) * (1 - r) * a / (1 - r * r * a * a);
    EXPECT_NEAR(through / expected, 1.0, 0.005);
}

// Paraxial rays through a ball lens meet n r / (2 (n - 1)) behind its centre.
TEST(Caustics, BallLensFocalLength) {
    for (const double n : {1.33, 1.6}) {
        const double r = 0.1, focus = n * r / (2 * (n - 1));
        Scene scene;
        add(scene, make_sphere(r, Vec3::Zero(), 128), Dielectric{n, Rgb::Zero()});
        add(scene, make_plane(0.5, -0.1001), Diffuse{});
        scene.lights.push_back(DirectionalLight{Vec3(0, 0, -1), Rgb::Constant(1.0f)});
        CausticOptions options;
        options.photon_count = 100000;
        const CausticPhotons result = trace_caustics(RenderScene(scene), options);
        double sum = 0, weight = 0;
        for (const Photon& p : result.photons) {
            const Vec3f d = -p.to_light.unpack();
            const double slope = d.head<2>().norm() / -d.z();
            const double x = p.position.head<2>().norm();
            // Paraxial, converging, not an internal reflection (those are faint).
            if (x > 0.02 * r || slope < 0.01 || slope > 0.08) continue;
            if (p.position.head<2>().dot(d.head<2>()) > 0) continue;
            const double z = 0.1001 + x / slope;  // below the centre, where it meets the axis
            sum += p.power[0] * z;
            weight += p.power[0];
        }
        ASSERT_GT(weight, 0.0);
        EXPECT_NEAR(sum / weight / focus, 1.0, 0.01) << n;
    }
}

TEST(Caustics, SameBitsForAnyThreadCount) {
    Scene scene = ball_on_table(0.05);
    const Camera camera = camera_at(Vec3(0.1, -0.4, 0.3), Vec3(0, 0, 0.03), 24, 16, 30);
    FinalOptions options;
    options.samples_per_pixel = 4;
    options.caustics.photon_count = 20000;
    std::vector<ImageRgb> images;
    for (const int threads : {1, 2, 8}) {
        set_thread_count(threads);
        images.push_back(render_image(RenderScene(scene), camera, options).radiance);
    }
    set_thread_count(0);
    for (std::size_t k = 1; k < images.size(); ++k) {
        EXPECT_EQ(std::memcmp(images[0].data(), images[k].data(), images[0].size() * sizeof(Rgb)),
                  0);
    }
}

// Photons against paths that find a large lamp by themselves: each pixel's difference in standard
// errors, at a level corrected for their number; and the mean.
TEST(Caustics, PhotonsAgreeWithPaths) {
    Scene scene = ball_on_table(0.15);
    scene.ambient_radiance = Rgb::Constant(0.1f);
    const RenderScene prepared(scene);
    const Camera camera = camera_at(Vec3(-0.1, -0.3, 0.5), Vec3(-0.04, -0.03, 0), 16, 12, 30);
    FinalOptions options;
    options.caustics.photon_count = 200000;
    options.caustics.gather_radius_m = 0.004;
    options.samples_per_pixel = 256;
    const RenderedImage photons = render_image(prepared, camera, options);
    options.use_photons = false;
    options.samples_per_pixel = 2048;
    options.seed = 1;
    const RenderedImage paths = render_image(prepared, camera, options);
    double sum_photons = 0, sum_paths = 0;
    std::vector<double> z;
    for (std::size_t i = 0; i < photons.radiance.size(); ++i) {
        const double a = luminance(photons.radiance[i]), b = luminance(paths.radiance[i]);
        sum_photons += a;
        sum_paths += b;
        // 2 % for the width of the gather.
        const double bias = 0.02 * b;
        const double error = std::sqrt(photons.variance[i] + paths.variance[i] + bias * bias);
        z.push_back(std::abs(a - b) / error);
    }
    EXPECT_NEAR(sum_photons / sum_paths, 1.0, 0.01);
    const double alpha = sidak(0.01, static_cast<double>(z.size()));
    const double limit = normal_quantile(1 - 0.5 * alpha);
    const auto beyond = std::count_if(z.begin(), z.end(), [&](double v) { return v > limit; });
    EXPECT_LE(beyond, static_cast<std::ptrdiff_t>(0.0125 * static_cast<double>(z.size())));
}

// Coloured glass on the table, coplanar with it: its shadow is lit, none of its light leaks below.
TEST(RenderScene, GlassTouchingTheTableLeaksNothing) {
    Scene scene;
    add(scene, make_plane(1.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false});
    add(scene, make_plane(1.0, -0.1), Diffuse{Rgb::Constant(0.5f), {}, {}, false});
    add(scene, make_box(Vec3(0.1, 0.1, 0.1), Vec3(0, 0, 0.05)), Dielectric{1.5, Rgb::Zero()});
    scene.lights.push_back(PointLight{Vec3(0.05, 0.02, 1), Rgb::Constant(1.0f)});
    CausticOptions options;
    options.photon_count = 20000;
    const CausticPhotons result = trace_caustics(RenderScene(scene), options);
    std::size_t below = 0;
    for (const Photon& p : result.photons) below += p.position.z() < -0.05f;
    EXPECT_EQ(below, 0u);
    EXPECT_GT(result.balance.stored, 0.6 * result.balance.emitted);
}

TEST(Media, SmallerBodyDisplacesLarger) {
    const std::vector<int> rank = {2, 0, 1};
    Media media;
    EXPECT_EQ(media.current(), Media::kNone);
    media.enter(0, rank);
    EXPECT_EQ(media.current(), 0);
    media.enter(1, rank);
    media.enter(2, rank);
    EXPECT_EQ(media.current(), 1);
    media.leave(1);
    EXPECT_EQ(media.current(), 2);
    media.leave(2);
    media.leave(0);
    EXPECT_EQ(media.current(), Media::kNone);
}

}  // namespace
}  // namespace vitrine
