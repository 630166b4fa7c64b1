// Translucent bodies on meshes: the fast sum against the plain one, closed forms, energy, and what
// a virtual object may change.
#include "base/parallel.h"
#include "geometry/primitives.h"
#include "optics/dipole.h"
#include "optics/fresnel.h"
#include "render/differential.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

/// A dipole's profile per channel, as a table in metres.
Translucent dipole_material(const std::array<DipoleMedium, 3>& media) {
    Translucent material;
    material.eta = media[0].eta;
    material.r_m.push_back(0);
    for (int i = 0; i < 160; ++i) material.r_m.push_back(1e-5 * std::pow(1e4, i / 159.0));
    for (const double r : material.r_m) {
        material.rd_per_m2.emplace_back(dipole_reflectance(media[0], r),
                                        dipole_reflectance(media[1], r),
                                        dipole_reflectance(media[2], r));
    }
    return material;
}

/// Albedo' 0.95, 0.98, 0.99; `length_m` = 1 / sigma_t'.
Translucent wax(double length_m, double eta = 1.3) {
    const double t = 1 / length_m;
    return dipole_material({DipoleMedium{0.95 * t, 0.05 * t, eta},
                            DipoleMedium{0.98 * t, 0.02 * t, eta},
                            DipoleMedium{0.99 * t, 0.01 * t, eta}});
}

Part make_part(const Mesh& mesh, const Material& material) {
    return {"part", std::make_shared<Mesh>(mesh), material, "", false};
}

Camera small_camera(const Vec3& eye, const Vec3& target, int size, double f) {
    Camera camera{"c", size, size, f, f, 0.5 * (size - 1), 0.5 * (size - 1), {}};
    camera.cam_from_world = look_at(eye, target, Vec3(0, 1, 0)).inverse();
    return camera;
}

Rgb mean_of(const ImageRgb& image) {
    Rgbd sum = Rgbd::Zero();
    for (const Rgb& p : image) sum += p.cast<double>();
    return (sum / static_cast<double>(image.size())).cast<float>();
}

/// Light from one side with a coloured gradient.
Rgb test_irradiance(const Vec3f& p, const Vec3f& n) {
    const float side = std::max(0.0f, n.dot(Vec3f(0.6f, 0.0f, 0.8f)));
    return Rgb(1.0f, 0.8f, 0.6f) * (0.05f + side * (1.0f + 8.0f * p.x()));
}

// Samples, split and interpolation together against the plain integral over six times as many
// points as the finest sampling has, with the profile as it is.
TEST(TranslucentBody, AgreesWithBruteForce) {
    const Mesh torus = make_torus(0.03, 0.012, Vec3::Zero(), 192, 96);
    const EvenSamples dense = sample_evenly(torus, 0.0003, 2);
    const EvenSamples places = sample_evenly(torus, 0.012, 3);
    for (const double length : {0.001, 0.003}) {
        const Translucent material = wax(length);
        const RadialProfile profile{material.r_m, material.rd_per_m2};
        const TranslucentBody body(std::make_shared<Mesh>(torus), material);
        std::vector<Rgb> irradiance;
        for (std::size_t i = 0; i < body.samples().size(); ++i) {
            irradiance.push_back(
                test_irradiance(body.samples().points[i], body.samples().normals[i]));
        }
        const std::vector<Rgb> far = body.exitance(irradiance);
        const KernelTable kernel(profile, 1e-12f, 0.1f);
        double error = 0, norm = 0;
        for (std::size_t i = 0; i < places.size(); ++i) {
            const Vec3f& p = places.points[i];
            Rgbd truth = Rgbd::Zero();
            for (std::size_t k = 0; k < dense.size(); ++k) {
                const float q = (dense.points[k] - p).squaredNorm() + 1e-12f;
                truth += (kernel(q).head<3>() * test_irradiance(dense.points[k], dense.normals[k]) *
                          dense.area_m2[k])
                             .cast<double>();
            }
            const Rgb ours = body.interpolate(far, p, places.normals[i]) +
                             body.near_share() * test_irradiance(p, places.normals[i]);
            error += (ours.cast<double>() - truth).abs().sum();
            norm += truth.sum();
            // Worst at the kink of the light's edge, which the samples round off.
            EXPECT_LT(((ours.cast<double>() - truth) / truth).abs().maxCoeff(), 0.08) << length;
        }
        EXPECT_LT(error / norm, 0.01) << length;
    }
}

// A thick slab under perpendicular light: B = albedo F_t E, seen through F_t again.
TEST(TranslucentBody, ThickSlabIsTheClosedForm) {
    const DipoleMedium medium{950, 50, 1.3};
    const double albedo = dipole_total(medium.albedo_prime(), medium.eta);
    Scene scene;
    scene.parts.push_back(make_part(make_box(Vec3(0.06, 0.06, 0.04)), wax(0.001)));
    scene.lights.push_back(DirectionalLight{Vec3(0, 0, -1), Rgb::Constant(2.0f)});
    const RenderScene prepared(scene);
    EXPECT_NEAR(prepared.body(0)->albedo()[0], albedo, 0.01 * albedo);
    FinalOptions options;
    options.samples_per_pixel = 4;
    const double through = fresnel_transmittance(1.0, 1.3);
    for (const bool use_photons : {false, true}) {
        options.use_photons = use_photons;
        const auto image =
            render_image(prepared, small_camera(Vec3(0, 0, 1), Vec3::Zero(), 8, 400), options);
        EXPECT_NEAR(mean_of(image.radiance)[0] / (albedo * through * 2 * through / kPi), 1, 0.01);
    }
}

// In a uniform environment everything below the interface is uniform, and no energy is made.
TEST(TranslucentBody, Furnace) {
    for (const double length : {1e-5, 0.01}) {
        Scene scene;
        scene.parts.push_back(make_part(make_sphere(0.05, Vec3::Zero(), 48), wax(length)));
        scene.ambient_radiance = Rgb::Ones();
        const RenderScene prepared(scene);
        const TranslucentLight light = light_translucent_bodies(prepared, nullptr, PathOptions{});
        // Enters: pi (1 - F), F the mean diffuse reflectance from outside, by quadrature.
        double entering = 0;
        for (int i = 0; i < 1000; ++i) {
            const double cosine = std::sqrt((i + 0.5) / 1000);
            entering += kPi * fresnel_transmittance(cosine, 1.3) / 1000;
        }
        const TranslucentBody& body = *prepared.body(0);
        ShadingPoint point;
        point.part = 0;
        for (const Vec3f& n : {Vec3f(0, 0, 1), Vec3f(0.6f, 0, -0.8f), Vec3f(0, -1, 0)}) {
            point.position = 0.05f * n;
            point.geometric_normal = n;
            const Rgb leaves = light.exitance(prepared, point, kAllParts) +
                               body.near_share() * static_cast<float>(entering);
            EXPECT_LT(leaves.maxCoeff(), entering) << length;
            if (length < 1e-4) {
                const Rgb expected = body.albedo() * static_cast<float>(entering);
                EXPECT_LT((leaves / expected - 1).abs().maxCoeff(), 0.01) << length;
            }
        }
    }
}

Scene lamp_behind(const Mesh& mesh) {
    Scene scene;
    scene.parts.push_back(make_part(mesh, wax(0.002)));
    scene.lights.push_back(DirectionalLight{Vec3(0, 0, 1), Rgb::Ones()});
    return scene;
}

TEST(TranslucentBody, ThinPartsGlowInLightFromBehind) {
    FinalOptions options;
    options.samples_per_pixel = 4;
    const Camera camera = small_camera(Vec3(0, 0, 1), Vec3::Zero(), 8, 800);
    Rgb glow[2];
    const double thickness[2] = {0.003, 0.02};
    for (int i = 0; i < 2; ++i) {
        const RenderScene prepared(lamp_behind(make_box(Vec3(0.08, 0.08, thickness[i]))));
        glow[i] = mean_of(render_image(prepared, camera, options).radiance);
    }
    EXPECT_GT(glow[0][2], 0.02f);
    EXPECT_GT(glow[0][2], 8 * glow[1][2]);
    // What absorbs least goes farthest.
    EXPECT_GT(glow[1][2], 2 * glow[1][0]);
}

// All light kinds enter: a lamp of each kind, alone, of the same irradiance (at a
// grazing angle less of it enters).
TEST(TranslucentBody, EveryLightKindEnters) {
    const auto map = std::make_shared<ImageRgb>(16, 8);
    for (Rgb& texel : *map) texel = Rgb::Constant(1 / kPif);
    const std::vector<Light> lights = {PointLight{Vec3(0, 0, 1), Rgb::Ones()},
                                       SpotLight{Vec3(0, 0, 1), Vec3(0, 0, -1), Rgb::Ones(), 40},
                                       DiscLight{Vec3(0, 0, 1), Vec3(0, 0, -1), 0.05, Rgb::Ones()},
                                       DirectionalLight{Vec3(0, 0, -1), Rgb::Ones()},
                                       EnvironmentLight{map, "", 1.0}};
    FinalOptions options;
    options.samples_per_pixel = 4;
    const Camera camera = small_camera(Vec3(0, 0, 0.5), Vec3::Zero(), 8, 400);
    std::vector<float> levels;
    for (const Light& light : lights) {
        Scene scene;
        scene.parts.push_back(
            make_part(make_box(Vec3(0.1, 0.1, 0.05), Vec3(0, 0, -0.025)), wax(0.002)));
        scene.lights.push_back(light);
        levels.push_back(mean_of(render_image(RenderScene(scene), camera, options).radiance)[1]);
    }
    for (const float level : levels) EXPECT_NEAR(level / levels[0], 1.0, 0.08);
}

// Sunlight focused by a ball onto a slab brings about the power that the ball casts a shadow of.
TEST(TranslucentBody, CausticsFeedIt) {
    double flux[2];
    for (const bool has_ball : {false, true}) {
        Scene scene;
        scene.parts.push_back(make_part(make_box(Vec3(0.1, 0.1, 0.02)), wax(0.002)));
        if (has_ball) {
            scene.parts.push_back(
                make_part(make_sphere(0.02, Vec3(0, 0, 0.035), 48), Dielectric{1.5, Rgb::Zero()}));
        }
        scene.lights.push_back(DirectionalLight{Vec3(0, 0, -1), Rgb::Ones()});
        const RenderScene prepared(scene);
        CausticOptions caustics;
        caustics.photon_count = 50'000;
        const CausticMaps maps = build_caustic_maps(trace_caustics(prepared, caustics).photons,
                                                    caustics.gather_radius_m);
        PathOptions paths;
        paths.direct_light_only = true;
        const TranslucentLight light = light_translucent_bodies(prepared, &maps, paths);
        double sum = 0;
        const EvenSamples& samples = prepared.body(0)->samples();
        for (std::size_t i = 0; i < samples.size(); ++i) {
            ShadingPoint point;
            point.part = 0;
            point.position = samples.points[i];
            point.geometric_normal = samples.normals[i];
            sum += light.exitance(prepared, point, kAllParts)[2] * samples.area_m2[i];
        }
        flux[has_ball] = sum;
    }
    const double shadow = kPi * 0.02 * 0.02 / 0.01;    // share of the face in the ball's shadow
    EXPECT_GT(flux[1], (1 - 0.3 * shadow) * flux[0]);  // without photons it would be 1 - shadow
    EXPECT_LT(flux[1], flux[0]);
}

// What lies in a hole of the table, or touches it, gets no light from beneath.
TEST(TranslucentBody, NoLightLeaksThroughTheTable) {
    Scene scene;
    scene.ambient_radiance = Rgb::Ones();
    scene.parts.push_back(make_part(make_box(Vec3(0.1, 0.1, 0.02)), wax(0.002)));
    scene.parts.push_back(make_part(make_plane(0.5, -0.009), Diffuse{Rgb::Zero(), {}, {}, false}));
    const RenderScene prepared(scene);  // sunk by 1 mm
    const TranslucentLight light = light_translucent_bodies(prepared, nullptr, PathOptions{});
    ShadingPoint point;
    point.part = 0;
    point.position = Vec3f(0, 0, -0.01f);
    point.geometric_normal = Vec3f(0, 0, -1);
    const Rgb below = light.exitance(prepared, point, kAllParts);
    point.position.z() = 0.01f;
    point.geometric_normal.z() = 1;
    EXPECT_LT(below[1], 0.05f * light.exitance(prepared, point, kAllParts)[1]);
}

TEST(TranslucentBody, SameBitsOnAnyThreadCount) {
    Scene scene = lamp_behind(make_torus(0.02, 0.008, Vec3::Zero()));
    scene.ambient_radiance = Rgb::Constant(0.1f);
    FinalOptions options;
    options.samples_per_pixel = 2;
    const Camera camera = small_camera(Vec3(0, 0, 0.5), Vec3::Zero(), 16, 100);
    ImageRgb images[2];
    for (const int threads : {1, 2}) {
        set_thread_count(threads);
        images[threads - 1] = render_image(RenderScene(scene), camera, options).radiance;
    }
    set_thread_count(0);
    for (std::size_t i = 0; i < images[0].size(); ++i) {
        EXPECT_TRUE((images[0][i] == images[1][i]).all());
    }
}

// A virtual body on a real table beside a real body: the difference is zero where neither shadow
// nor bounced light reaches, and the body's light warms the table under it.
TEST(TranslucentBody, DifferenceIsZeroWhereNothingChanged) {
    Scene real;
    real.parts.push_back(make_part(make_plane(1.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false}));
    real.parts.push_back(make_part(make_box(Vec3(0.1, 0.1, 0.1), Vec3(-0.3, 0, 0.05)), wax(0.003)));
    real.lights.push_back(DirectionalLight{Vec3(0, 0, -1), Rgb::Ones()});
    const Part added = make_part(make_box(Vec3(0.1, 0.1, 0.02), Vec3(0.2, 0, 0.05)), wax(0.003));
    const Camera camera = small_camera(Vec3(0, 0, 1.2), Vec3::Zero(), 48, 55);
    DifferentialOptions options;
    options.min_samples = options.max_samples = 2;
    options.photon_count = 1000;
    options.paths.direct_light_only = true;
    const DifferentialImage image =
        DifferentialRenderer(real, {added}, {&camera, 1}, options).render(camera);
    double changed = 0;
    for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 24; ++x) {  // the half with the real body
            EXPECT_TRUE((image.with(x, y) == image.without(x, y)).all());
        }
        for (int x = 24; x < 48; ++x) changed += (image.with(x, y) - image.without(x, y)).sum();
    }
    EXPECT_NE(changed, 0);
}

// A lamp over a virtual slab: the table in its shadow is lit by what comes through it.
TEST(TranslucentBody, LightOfABodyReachesTheRealScene) {
    Scene real;
    real.parts.push_back(make_part(make_plane(1.0), Diffuse{Rgb::Constant(0.5f), {}, {}, false}));
    real.lights.push_back(DirectionalLight{Vec3(0, 0, -1), Rgb::Ones()});
    const Mesh slab = make_box(Vec3(0.1, 0.1, 0.004), Vec3(0, 0, 0.03));
    const Camera camera = small_camera(Vec3(0, -0.12, 0.02), Vec3::Zero(), 8, 200);
    DifferentialOptions options;
    options.min_samples = options.max_samples = 32;
    options.photon_count = 1000;
    Rgb shadow[2];
    for (const bool is_body : {false, true}) {
        const Material material =
            is_body ? Material(wax(0.002)) : Material(Diffuse{Rgb::Zero(), {}, {}, false});
        shadow[is_body] =
            mean_of(DifferentialRenderer(real, {make_part(slab, material)}, {&camera, 1}, options)
                        .render(camera)
                        .with);
    }
    EXPECT_LT(shadow[0][2], 0.01f);
    EXPECT_GT(shadow[1][2], 0.02f);
    EXPECT_GT(shadow[1][2], 1.05f * shadow[1][0]);  // red is absorbed most
}

}  // namespace
}  // namespace vitrine
