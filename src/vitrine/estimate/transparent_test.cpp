#include "estimate/transparent.h"

#include "estimate/model_error.h"
#include "estimate/object_pixels.h"
#include "geometry/primitives.h"
#include "render/estimation_refraction.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// A glass ball on a table, as `look_through` or, with a wall, `look_through_vessel` itself
/// predicts it: recovery must be nearly exact.
struct Ball {
    Scene scene;
    std::vector<RgbdFrame> frames;

    /// @param pattern 0: table and surroundings of one even radiance
    Ball(double ior, const Rgb& sigma_a, float pattern, double wall_m = 0.0, double table_m = 1.6) {
        Mesh table = make_plane(table_m, 0.0, 240);
        table.colours.clear();
        for (const Vec3f& v : table.vertices) {
            const float wave = std::sin(90.0f * v.x()) * std::sin(70.0f * v.y() + 1.0f);
            table.colours.push_back(Rgb::Constant(0.5f + 0.3f * pattern * wave));
        }
        Part scan, object;
        scan.name = "scan";
        scan.mesh = std::make_shared<const Mesh>(std::move(table));
        object.name = "object_0";
        object.mesh = std::make_shared<const Mesh>(make_sphere(0.045, Vec3(0, 0, 0.0455), 48));
        scene.parts = {scan, object};
        for (int k = 0; k < 5; ++k) {
            const double angle = 2.0 * kPi * k / 5.0;
            Camera camera;
            camera.width = 120;
            camera.height = 90;
            camera.fx = camera.fy = 130;
            camera.cx = 59.5;
            camera.cy = 44.5;
            camera.cam_from_world = look_at(Vec3(0.4 * std::cos(angle), 0.4 * std::sin(angle), 0.4),
                                            Vec3(0, 0, 0.03), Vec3(0, 0, 1))
                                        .inverse();
            scene.cameras.push_back(camera);
        }
        const EstimationScene world(scene);
        for (const Camera& camera : scene.cameras) {
            RgbdFrame frame;
            frame.id = std::to_string(frames.size());
            frame.camera = camera;
            frame.colour = ImageRgb(camera.width, camera.height);
            const Vec3f eye = camera.centre_in_world().cast<float>();
            for (int v = 0; v < camera.height; ++v)
                for (int u = 0; u < camera.width; ++u) {
                    const Vec3f ray = camera.ray_in_world(u, v).cast<float>();
                    const Hit hit = world.accel().closest({eye, ray, 0.0f, 1e30f, kScanMask});
                    const auto seen = world.scan_radiance(hit, ray);
                    frame.colour(u, v) = seen ? *seen : kAmbient;
                }
            frames.push_back(std::move(frame));
        }
        const FrameLookup lookup(world, scene.cameras, frames, 1e9);
        const std::vector<ObjectPixel> all =
            object_pixels(world, lookup, 0, {.pixels_per_view = 100'000, .border_px = 0});
        const std::vector<ThroughPixel> through =
            wall_m > 0.0 ? look_through_vessel(world, lookup, 0, all, ior, wall_m, kAmbient)
                         : look_through(world, lookup, 0, all, ior, kAmbient);
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (!through[i].is_valid) continue;
            frames[static_cast<std::size_t>(all[i].frame)].colour(all[i].u, all[i].v) =
                through[i].transmitted * (-sigma_a * through[i].length_m).exp() +
                through[i].side_light(sigma_a);
        }
    }

    TransparentFit fit(const TransparentOptions& options = lit()) const {
        return fit_with(fit_solid, options);
    }
    TransparentFit fit_as_vessel() const { return fit_with(fit_shell, lit()); }
    static TransparentOptions lit() {
        TransparentOptions options;
        options.ambient = kAmbient;
        return options;
    }

    template <typename Fit>
    TransparentFit fit_with(const Fit& fit, const TransparentOptions& options) const {
        const EstimationScene world(scene);
        const FrameLookup lookup(world, scene.cameras, frames, 1e9);
        return fit(world, lookup, 0, object_pixels(world, lookup, 0), bright_level(lookup),
                   options);
    }

    inline static const Rgb kAmbient = Rgb::Constant(0.5f);
};

TEST(FitSolid, RecoversItsOwnPrediction) {
    const Rgb sigma_a(4, 1, 8);
    const TransparentFit fit = Ball(1.46, sigma_a, 1.0f).fit();
    EXPECT_EQ(fit.ior.outcome, Outcome::Converged);
    EXPECT_NEAR(fit.ior.value, 1.46, 0.01);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(fit.sigma_a_per_m.value[c], sigma_a[c], 0.3);
}

TEST(FitSolid, SaysThatAnEvenBackgroundShowsNoIndex) {
    const TransparentFit fit = Ball(1.5, Rgb::Zero(), 0.0f).fit();
    EXPECT_EQ(fit.ior.outcome, Outcome::NotIdentifiable);
    EXPECT_NE(fit.ior.reason.find("even"), std::string::npos);
    EXPECT_TRUE(std::isfinite(fit.ior.value) && std::isfinite(fit.ior.stddev));
}

TEST(FitSolid, SaysWhenTheIndexLiesAtTheEndOfTheRange) {
    TransparentOptions options = Ball::lit();
    options.ior_min = 1.4;
    const TransparentFit fit = Ball(1.25, Rgb::Zero(), 1.0f).fit(options);
    EXPECT_EQ(fit.ior.outcome, Outcome::AtBound);
    EXPECT_FALSE(fit.ior.reason.empty());
}

TEST(FitSolid, AnswersOnTheGridAskedFor) {
    TransparentOptions options = Ball::lit();
    options.ior_step = 0.02;
    const TransparentFit fit = Ball(1.463, Rgb::Zero(), 1.0f).fit(options);
    EXPECT_NEAR(fit.ior.value, 1.46, 1e-9);
}

TEST(FitSolid, TheDoubtOfTheIndexGoesOnIntoTheAbsorption) {
    TransparentFit fit;
    fit.cost = 0.04;
    fit.sigma_a_per_m.value = Rgb(1, 2, 3);
    TransparentFit steep = fit, known = fit;
    const SolidDoubt flat_doubt{0.01, Rgb::Zero(), 0.05}, doubt{0.01, Rgb(0, 50, -50), 0.05};
    add_model_error(fit, {}, flat_doubt);
    add_model_error(steep, {}, doubt);
    TransparentOptions options;
    options.known_ior = 1.5;
    add_model_error(known, options, doubt);
    EXPECT_GE(fit.ior.stddev, 0.01);
    EXPECT_EQ(known.ior.stddev, 0.0);
    for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(known.sigma_a_per_m.stddev[c], fit.sigma_a_per_m.stddev[c]);
        EXPECT_NEAR(steep.sigma_a_per_m.stddev[c],
                    std::hypot(fit.sigma_a_per_m.stddev[c], c == 0 ? 0.0 : 50 * fit.ior.stddev),
                    1e-4);
    }
}

/// A scan so small that much of what is seen through the ball lies beyond it.
TEST(FitSolid, LearnsHowBrightItIsBeyondTheScan) {
    const Rgb sigma_a(4, 1, 8);
    const Ball ball(1.6, sigma_a, 1.0f, 0.0, 0.12);
    TransparentOptions options;
    options.ambient = 0.7f * Ball::kAmbient;
    const TransparentFit fit = ball.fit(options);
    EXPECT_NEAR(fit.ior.value, 1.6, 0.01);
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(fit.beyond[c], Ball::kAmbient[c], 0.02f);
        EXPECT_NEAR(fit.sigma_a_per_m.value[c], sigma_a[c], 0.3);
    }
    options.is_ambient_known = true;
    const TransparentFit misled = ball.fit(options);
    EXPECT_GT((misled.sigma_a_per_m.value - sigma_a).abs().maxCoeff(), 0.3f);
}

TEST(FitSolid, KeepsTheAmbientLightWhereGlassShowsNothingElse) {
    TransparentOptions options;
    options.ambient = 0.7f * Ball::kAmbient;
    const TransparentFit fit = Ball(1.46, Rgb(4, 1, 8), 1.0f).fit(options);
    EXPECT_TRUE((fit.beyond == options.ambient).all());
}

TEST(FitShell, RecoversItsOwnWall) {
    const TransparentFit fit = Ball(1.5, Rgb(4, 1, 8), 1.0f, 0.0023).fit_as_vessel();
    EXPECT_EQ(fit.wall_m.outcome, Outcome::Converged);
    EXPECT_NEAR(std::log2(fit.wall_m.value / 0.0023), 0.0, 0.25);
    EXPECT_EQ(fit.ior.outcome, Outcome::NotIdentifiable);
    EXPECT_FALSE(fit.ior.reason.empty());
}

TEST(FitShell, SaysThatTheThinnestWallsTellNoThickness) {
    const TransparentFit fit = Ball(1.5, Rgb::Zero(), 1.0f, 0.0004).fit_as_vessel();
    EXPECT_EQ(fit.wall_m.outcome, Outcome::NotIdentifiable);
    EXPECT_NE(fit.wall_m.reason.find("thinnest"), std::string::npos);
}

TEST(FitShell, SaysThatAnEvenBackgroundShowsNoWall) {
    const TransparentFit fit = Ball(1.5, Rgb::Zero(), 0.0f, 0.0023).fit_as_vessel();
    EXPECT_EQ(fit.wall_m.outcome, Outcome::NotIdentifiable);
    EXPECT_NE(fit.wall_m.reason.find("even"), std::string::npos);
    EXPECT_TRUE(std::isfinite(fit.wall_m.value) && std::isfinite(fit.wall_m.stddev));
}

TEST(ObjectPixels, NormalsThatTurnOneWayOnlyWidenNoLobe) {
    Ball ball(1.5, Rgb::Zero(), 1.0f);
    const auto mean_variance = [&]() {
        const EstimationScene world(ball.scene);
        const FrameLookup lookup(world, ball.scene.cameras, ball.frames, 1e9);
        double sum = 0.0;
        const std::vector<ObjectPixel> pixels = object_pixels(world, lookup, 0);
        for (const ObjectPixel& pixel : pixels) sum += pixel.normal_variance;
        return sum / static_cast<double>(pixels.size());
    };
    const double of_ball = mean_variance();
    EXPECT_GT(of_ball, 1e-4);
    Mat4 lying = Mat4::Identity();
    lying.topLeftCorner<3, 3>() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
    lying(0, 3) = -0.2;
    lying(2, 3) = 0.031;
    ball.scene.parts[1].mesh = std::make_shared<const Mesh>(
        transformed(make_cylinder(0.03, 0.4, Vec3::Zero(), 96), lying));
    EXPECT_LT(mean_variance(), 0.1 * of_ball);
}

TEST(RefractThrough, PassesABodyThatIsMetAgain) {
    constexpr double kRadius = 0.02;
    Mesh pair = make_sphere(kRadius, Vec3(-0.03, 0, 0), 96);
    append(pair, make_sphere(kRadius, Vec3(0.03, 0, 0), 96));
    Scene scene;
    Part table, object;
    table.name = "scan";
    table.mesh = std::make_shared<const Mesh>(make_plane(1.0, -0.1, 2));
    object.name = "object_0";
    object.mesh = std::make_shared<const Mesh>(std::move(pair));
    scene.parts = {table, object};
    const EstimationScene world(scene);
    const Vec3f eye(-0.4f, 1e-4f, 1e-4f), ahead(1, 0, 0);
    const RefractedPath path = refract_through(world, 0, eye, ahead, 1.5f);
    ASSERT_TRUE(path.is_valid);
    EXPECT_GT(path.exit.x(), 0.045f);
    EXPECT_NEAR(path.length_m, 4.0 * kRadius, 1e-3);
    EXPECT_NEAR(path.transmittance, std::pow(0.96, 4), 1e-3);
}

}  // namespace
}  // namespace vitrine
