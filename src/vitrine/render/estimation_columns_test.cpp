#include "render/estimation_columns.h"

#include "base/parallel.h"
#include "geometry/primitives.h"
#include "math/optimise.h"
#include "render/caustics.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

constexpr double kTrueIor = 1.487;
constexpr double kRadius = 0.003;

Camera camera_at(const Vec3& eye, const Vec3& target, int width, int height, double f) {
    Camera camera{"c", width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1), {}};
    camera.cam_from_world = look_at(eye, target, Vec3(0, 0, 1)).inverse();
    return camera;
}

TrialLight lamp() { return {Vec3(0.3, 0.2, 0.6), Vec3(-0.3, -0.2, -0.55).normalized(), 0.02}; }

/// A glass ball on a table, seen by two cameras, as reconstruction would name it.
Scene ball_scene(double ior) {
    Scene scene;
    const auto add = [&](const char* name, const Mesh& mesh, const Material& material) {
        scene.parts.push_back({name, std::make_shared<Mesh>(mesh), material, "", false});
    };
    add("scan", make_plane(1.0), Diffuse{Rgb::Constant(0.6f), {}, {}, false});
    add("object_0", make_sphere(0.05, Vec3(0, 0, 0.055), 64), Dielectric{ior, Rgb(3, 1, 2)});
    scene.lights.push_back(
        DiscLight{lamp().position_m, lamp().normal, lamp().radius_m, Rgb::Constant(1.0f)});
    for (const double angle : {0.3, 2.0}) {
        scene.cameras.push_back(camera_at(Vec3(0.7 * std::cos(angle), 0.7 * std::sin(angle), 0.5),
                                          Vec3(-0.05, -0.03, 0), 240, 180, 280));
    }
    return scene;
}

double mean(std::span<const Rgb> values, int channel) {
    double sum = 0;
    for (const Rgb& v : values) sum += v[channel];
    return sum / static_cast<double>(values.size());
}

struct Prepared {
    EstimationScene scene{ball_scene(kTrueIor)};
    ViewReceivers receivers;
    std::shared_ptr<const ReceiverGrid> grid;
    std::vector<double> iors;

    Prepared() {
        for (int i = 0; i < 5; ++i) iors.push_back(1.3 + 0.1 * i);
        receivers = caustic_receivers(scene, 0, ball_scene(kTrueIor).cameras, lamp(), iors, 0);
        grid = std::make_shared<const ReceiverGrid>(receivers.points, kRadius);
    }
    CausticColumns columns(int photon_count) const {
        CausticBeamOptions options;
        options.photon_count = photon_count;
        return {CausticBeam(scene, 0, lamp(), 0, options), grid};
    }
};

TEST(EstimationColumns, ReceiversAreWhereTheObjectChangesTheLight) {
    const Prepared world;
    ASSERT_GT(world.receivers.points.size(), 500u);
    EXPECT_LT(world.receivers.points.size(), 20'000u);  // of 86 400 pixels
    // Away from the lamp, beside and behind the ball; never on it.
    for (const SurfacePoint& p : world.receivers.points) {
        EXPECT_NEAR(p.position.z(), 0.0f, 1e-5f);
        EXPECT_LT(p.position.norm(), 0.25f);
    }
}

TEST(EstimationColumns, AgreeWithTheDirectGather) {
    const Prepared world;
    const std::vector<Rgb> column = world.columns(100'000).at(1.5, Rgb(3, 1, 2));
    TrialCaustic trial;
    trial.sigma_a_per_m = Rgb(3, 1, 2);
    trial.gather_radius_m = kRadius;
    const std::vector<Rgb> direct =
        caustic_irradiance(world.scene, 0, lamp(), world.receivers.points, 0, trial);
    double difference = 0, power = 0;
    for (std::size_t i = 0; i < direct.size(); ++i) {
        difference += (column[i] - direct[i]).square().sum();
        power += direct[i].square().sum();
    }
    EXPECT_LT(std::sqrt(difference / power), 0.06);  // cells blur by a sixth of the radius
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean(column, c) / mean(direct, c), 1.0, 0.01);
}

TEST(EstimationColumns, KernelIntegratesToOneOnTiltedSurfaces) {
    for (const Vec3f& tilt : {Vec3f(0, 0, 1), Vec3f(0.3f, -0.5f, 0.8f), Vec3f(-1, 0.8f, 0.7f)}) {
        const Frame frame(tilt.normalized());
        std::vector<SurfacePoint> receivers;
        for (int y = -20; y <= 20; ++y) {
            for (int x = -20; x <= 20; ++x) {
                receivers.push_back({0.0005f * (static_cast<float>(x) * frame.tangent +
                                                static_cast<float>(y) * frame.bitangent),
                                     frame.normal});
            }
        }
        const ReceiverGrid grid(receivers, kRadius);
        BeamArrival photon;
        photon.position = 0.00031f * frame.tangent - 0.0007f * frame.bitangent;
        photon.normal = frame.normal;
        photon.power = Rgb::Ones();
        double flux = 0;
        for (const Rgb& e : grid.gather({&photon, 1})) flux += e[0] * 0.0005 * 0.0005;
        EXPECT_NEAR(flux, 1.0, 0.02);
    }
}

// The whole renderer makes the picture, with other random numbers and all faint reflections.
TEST(EstimationColumns, TheTrueIndexFitsBest) {
    const Prepared world;
    CausticOptions options;
    options.photon_count = 400'000;
    const PhotonGrid photons(trace_caustics(RenderScene(ball_scene(kTrueIor)), options).photons,
                             kRadius);
    std::vector<float> observed;
    for (const SurfacePoint& p : world.receivers.points) {
        float sum = 0;
        photons.gather(p.position, p.normal, [&](const Photon& photon, float kernel) {
            sum += kernel * photon.power[1];
        });
        observed.push_back(sum);
    }
    const CausticColumns columns = world.columns(40'000);
    constexpr float kClip = 8.0f;  // of a direct level of about 2
    const auto cost = [&](const std::vector<Rgb>& column) {
        double sum = 0;
        for (std::size_t i = 0; i < observed.size(); ++i) {
            const double d = std::min(column[i][1], kClip) - std::min(observed[i], kClip);
            sum += d * d;
        }
        return sum;
    };
    const Minimum1d best = minimise_golden(
        [&](double ior) { return cost(columns.at(ior, Rgb(3, 1, 2))); }, 1.45, 1.53, 11);
    EXPECT_NEAR(best.x, kTrueIor, 0.002);
}

TEST(EstimationColumns, SameBitsOnAnyNumberOfThreads) {
    const Prepared world;
    set_thread_count(1);
    const auto one = world.columns(20'000).at(world.iors);
    set_thread_count(2);
    const auto two = world.columns(20'000).at(world.iors);
    set_thread_count(0);
    ASSERT_EQ(one.size(), two.size());
    for (std::size_t n = 0; n < one.size(); ++n) {
        for (std::size_t i = 0; i < one[n].size(); ++i) {
            ASSERT_TRUE((one[n][i] == two[n][i]).all());
        }
    }
}

}  // namespace
}  // namespace vitrine
