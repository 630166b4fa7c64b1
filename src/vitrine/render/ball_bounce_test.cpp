#include "render/ball_bounce.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

Relief cluster_of(std::vector<Ball> balls) {
    Relief relief;
    relief.mask = Mask(4, 4);
    relief.balls = std::move(balls);
    return relief;
}

TEST(BallBounce, APointSeesWhatABallFillsOfItsSky) {
    // A ball of radius R whose centre lies d straight ahead fills (R / d)^2 of the cosine.
    for (const double d : {1.2, 1.6, 2.5}) {
        const Relief relief = cluster_of({{Vec3f(0, 0, static_cast<float>(10 * d)), 10}});
        const BallBounce bounce(relief);
        double share = 0, sky = 0;
        const auto turns = fibonacci_directions(301, -1.0);
        // Rays are few and the same for all points: the mean over many ways up.
        for (const Vec3& up : turns) {
            const std::vector<Vec3f> position = {(10 * d * (Vec3(0, 0, 1) - up)).cast<float>()};
            const std::vector<Vec3f> normal = {up.cast<float>()};
            const std::vector<std::int16_t> none = {-1};
            const BallBounce::View view = bounce.view_from({position, normal, none});
            EXPECT_NEAR(view.patches.sum() + view.sky.ambient[0], 1, 1e-5);
            share += view.patches.sum() / static_cast<double>(turns.size());
            sky += view.sky.ambient[0] / static_cast<double>(turns.size());
        }
        EXPECT_NEAR(share, 1 / (d * d), 0.03);
    }
}

TEST(BallBounce, ABallAloneThrowsBackItsAlbedo) {
    const Relief relief = cluster_of({{Vec3f(3, -5, 2), 7}});
    const BallBounce bounce(relief);
    const auto count = static_cast<Eigen::Index>(bounce.patches().position.size());
    Eigen::MatrixXf light = Eigen::MatrixXf::Zero(count, 2);
    light.col(0).setOnes();
    light(5, 1) = 1;
    const Eigen::MatrixXf exitance = bounce.exitance(light, 0.6);
    EXPECT_NEAR(exitance.col(0).sum(), 0.6 * static_cast<double>(count), 1e-3);
    EXPECT_NEAR(exitance.col(1).sum(), 0.6, 1e-5);
    EXPECT_GT(exitance(5, 1), exitance(20, 1));
}

TEST(BallBounce, BallsLightEachOther) {
    // One is lit, the other in the dark: it gets the lit one's light, more where it faces it, and
    // none where it looks away.
    const Relief relief = cluster_of({{Vec3f(0, 0, 0), 10}, {Vec3f(20, 0, 0), 10}});
    const BallBounce bounce(relief);
    const SurfacePoints patches = bounce.patches();
    const auto half = static_cast<Eigen::Index>(patches.position.size() / 2);
    Eigen::MatrixXf light = Eigen::MatrixXf::Zero(2 * half, 1);
    light.topRows(half).setOnes();
    const Eigen::MatrixXf weak = bounce.exitance(light, 0.3), strong = bounce.exitance(light, 0.8);
    EXPECT_GT(weak.bottomRows(half).sum(), 0);
    // First order in the albedo on the lit ball, second on the other.
    EXPECT_NEAR(strong.bottomRows(half).sum() / weak.bottomRows(half).sum(), std::pow(8 / 3.0, 2),
                1.2);
    const std::vector<Vec3f> position = {Vec3f(10, 0, 0.01f), Vec3f(30, 0, 0)},
                             normal = {Vec3f(-1, 0, 0), Vec3f(1, 0, 0)};
    const std::vector<std::int16_t> own = {1, 1};
    Eigen::MatrixXf rgb(2 * half, 3);
    for (int c = 0; c < 3; ++c) rgb.col(c) = strong;
    const Eigen::MatrixXf seen = bounce.view_from({position, normal, own}).patches * rgb;
    EXPECT_GT(seen(0, 0), 0.4f);
    EXPECT_EQ(seen(1, 0), 0.0f);
}

}  // namespace
}  // namespace vitrine
