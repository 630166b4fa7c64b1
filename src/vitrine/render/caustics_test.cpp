#include "render/caustics.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "geometry/primitives.h"
#include "math/statistics.h"
#include "optics/fresnel.h"
#include "render/caustic_maps.h"
#include "render/differential.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <tuple>

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

// Two passes of half the rays are the rays of one pass, each with twice the power.
TEST(Caustics, PassesContinueTheSequence) {
    const RenderScene scene(ball_on_table(0.05));
    CausticOptions options;
    options.photon_count = 2000;
    std::vector<Photon> whole = trace_caustics(scene, options).photons;
    options.photon_count = 1000;
    std::vector<Photon> halves = trace_caustics(scene, options).photons;
    options.pass = 1;
    const std::vector<Photon> second = trace_caustics(scene, options).photons;
    halves.insert(halves.end(), second.begin(), second.end());
    ASSERT_EQ(whole.size(), halves.size());
    // A pass sends its rays in an order of its own.
    const auto by_place = [](const Photon& a, const Photon& b) {
        return std::tuple(a.position.x(), a.position.y(), a.power[0]) <
               std::tuple(b.position.x(), b.position.y(), b.power[0]);
    };
    std::sort(whole.begin(), whole.end(), by_place);
    std::sort(halves.begin(), halves.end(), by_place);
    for (std::size_t i = 0; i < whole.size(); ++i) {
        EXPECT_EQ(whole[i].position, halves[i].position);
        EXPECT_NEAR(halves[i].power[0], 2 * whole[i].power[0], 1e-5f * halves[i].power[0]);
    }
}

// The radius vanishes, so does the blur; the photons within grow without bound, so the noise does.
TEST(Caustics, ProgressiveRadiusLosesBlurAndNoise) {
    EXPECT_EQ(progressive_radius(0.002, 0), 0.002);
    double found = 1;  // photons within the radius, over all passes, in units of the first's
    for (int pass = 1; pass < 2000; ++pass) {
        const double r = progressive_radius(1.0, pass);
        EXPECT_LT(r, progressive_radius(1.0, pass - 1));
        found += r * r;
    }
    EXPECT_LT(progressive_radius(1.0, 2000), 0.3);
    EXPECT_NEAR(found, 1.5 * std::pow(2000.0, 2.0 / 3.0) / std::tgamma(5.0 / 3.0), 0.01 * found);
}

// Sunlight through a plate ends at a sharp edge: near it a wide gather finds too little, and
// progressive passes less and less so.
TEST(Caustics, ProgressivePassesSharpenAnEdge) {
    Scene scene;
    add(scene, make_plane(1.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false});
    add(scene, make_box(Vec3(0.2, 0.2, 0.01), Vec3(0, 0, 0.3)), Dielectric{1.5, Rgb::Zero()});
    scene.lights.push_back(DirectionalLight{Vec3(0, 0, -1), Rgb::Constant(1.0f)});
    const RenderScene prepared(scene);
    // Looks under the plate at its shadow's edge, 3 mm inside.
    const Camera camera = camera_at(Vec3(0.5, 0, 0.15), Vec3(0.097, 0, 0), 1, 1, 2000);
    const double r = 0.04, both = (1 - r) * (1 - r) / (1 - r * r);  // all internal reflections
    const double expected = 0.5 / kPi * both;
    FinalOptions options;
    options.samples_per_pixel = 128;
    options.caustics.gather_radius_m = 0.012;
    options.caustics.photon_count = 1 << 18;
    options.paths.max_diffuse_bounces = 0;
    const auto error = [&](int pass_photon_count) {
        options.pass_photon_count = pass_photon_count;
        const double value = render_image(prepared, camera, options).radiance[0][1];
        return 1 - value / expected;
    };
    const double fixed = error(1 << 18), progressive = error(1 << 13);
    EXPECT_GT(fixed, 0.2);
    EXPECT_LT(progressive, 0.8 * fixed);
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

// The list itself, of glass, paint and a glossy table; more photons than a block has.
TEST(Caustics, SamePhotonsForAnyThreadCount) {
    Scene scene = ball_on_table(0.05);
    add(scene, make_plane(0.3, 0.001),
        Ward{Rgb::Constant(0.3f), Rgb::Constant(0.3f), 0.1, 0.1, WardForm::Duer});
    const RenderScene prepared(scene);
    CausticOptions options;
    options.photon_count = 30000;
    std::vector<CausticPhotons> results;
    for (const int threads : {1, 2, 8}) {
        set_thread_count(threads);
        results.push_back(trace_caustics(prepared, options));
    }
    set_thread_count(0);
    const std::vector<Photon>& first = results[0].photons;
    const auto is_glossy = [](const Photon& photon) { return photon.is_glossy; };
    EXPECT_GT(std::count_if(first.begin(), first.end(), is_glossy), 100);
    for (const CausticPhotons& result : results) {
        ASSERT_EQ(result.photons.size(), first.size());
        EXPECT_EQ(std::memcmp(result.photons.data(), first.data(), first.size() * sizeof(Photon)),
                  0);
        EXPECT_EQ(result.balance.stored, results[0].balance.stored);
    }
}

// Photons against paths that find a large lamp by themselves: each pixel's difference in standard
// errors, at a level corrected for their number; and the mean.
void expect_photons_agree_with_paths(const Scene& scene) {
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

TEST(Caustics, PhotonsAgreeWithPaths) {
    Scene scene = ball_on_table(0.15);
    scene.ambient_radiance = Rgb::Constant(0.1f);
    expect_photons_agree_with_paths(scene);
}

TEST(Caustics, GlossyPhotonsAgreeWithPaths) {
    Scene scene = ball_on_table(0.15);
    scene.parts.back().material =
        Ward{Rgb::Constant(0.1f), Rgb(0.6f, 0.4f, 0.3f), 0.2, 0.2, WardForm::Duer};
    expect_photons_agree_with_paths(scene);
}

TEST(Differential, SameBitsForAnyThreadCount) {
    const Scene scene = ball_on_table(0.05);
    const Camera camera = camera_at(Vec3(0.1, -0.4, 0.3), Vec3(0, 0, 0.03), 20, 12, 25);
    Part box{"box", std::make_shared<Mesh>(make_box(Vec3(0.05, 0.05, 0.05), Vec3(-0.1, 0, 0.025))),
             Diffuse{}, "", true};
    DifferentialOptions options;
    options.photon_count = 20000;
    options.min_samples = 4;
    options.max_samples = 16;
    std::vector<DifferentialImage> images;
    for (const int threads : {1, 2, 8}) {
        set_thread_count(threads);
        const DifferentialRenderer renderer(scene, {box}, std::vector<Camera>{camera}, options);
        images.push_back(renderer.render(camera));
    }
    set_thread_count(0);
    const auto bytes = images[0].with.size() * sizeof(Rgb);
    for (const DifferentialImage& other : images) {
        EXPECT_EQ(std::memcmp(images[0].with.data(), other.with.data(), bytes), 0);
        EXPECT_EQ(std::memcmp(images[0].caustics.data(), other.caustics.data(), bytes), 0);
    }
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

TEST(CausticMaps, SecondaryLightsAreChosenByTheirFlux) {
    std::vector<Photon> photons;
    Rng rng(5);
    for (int k = 0; k < 40; ++k) {
        Photon photon;
        photon.position = Vec3f(0.1f * static_cast<float>(k), 0, 0);  // each a patch of its own
        photon.normal = PackedDirection(Vec3f(0, 0, 1));
        photon.power = Rgb(rng.next_float(), rng.next_float(), rng.next_float());
        photon.set_diffuse_albedo(Rgb::Constant(k % 4 == 0 ? 0.0f : 0.6f));  // some do not reflect
        photons.push_back(photon);
    }
    const CausticMaps maps = build_caustic_maps(photons, 0.001);
    ASSERT_EQ(maps.secondary.size(), 30u);
    std::vector<double> observed(30, 0.0), expected(30, 0.0);
    constexpr int kDraws = 30000;
    double sum = 0;
    for (const SecondaryLight& light : maps.secondary) sum += luminance(light.flux);
    for (std::size_t i = 0; i < 30; ++i) {
        expected[i] = kDraws * luminance(maps.secondary[i].flux) / sum;
        EXPECT_NEAR(maps.secondary_choice.probability(i) * kDraws, expected[i], 1e-4 * expected[i]);
    }
    for (int k = 0; k < kDraws; ++k) {
        float u = rng.next_float();
        observed[maps.secondary_choice.sample(u)] += 1;
    }
    EXPECT_GT(chi_square_test(observed, expected).p_value, 0.001);
}

}  // namespace
}  // namespace vitrine
