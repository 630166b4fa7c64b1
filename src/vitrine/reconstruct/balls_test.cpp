#include "reconstruct/balls.h"

#include "reconstruct/relief.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

struct Picture {
    ImageRgb shown{260, 220, Rgb(0.3f, 0.3f, 0.3f)};
    Mask mask{260, 220};
};

/// Balls in front of each other in the order of their height, softly lit; `tall`: stretched upward
/// by this factor and squeezed across by it.
Picture picture_of(const std::vector<Ball>& balls, float tall = 1) {
    Picture picture;
    for (int y = 0; y < picture.mask.height(); ++y) {
        for (int x = 0; x < picture.mask.width(); ++x) {
            float highest = -1e30f;
            for (const Ball& ball : balls) {
                const Vec3f v((static_cast<float>(x) - ball.centre_px.x()) * tall,
                              (static_cast<float>(-y) - ball.centre_px.y()) / tall, 0);
                const float rest = ball.radius_px * ball.radius_px - v.squaredNorm();
                if (rest <= 0 || ball.centre_px.z() + std::sqrt(rest) <= highest) continue;
                highest = ball.centre_px.z() + std::sqrt(rest);
                const Vec3f n = Vec3f(v.x() * tall, v.y() / tall, std::sqrt(rest)).normalized();
                const float light = std::max(0.0f, n.dot(Vec3f(-0.5f, 0.6f, 0.62f)));
                picture.shown(x, y) = Rgb(0.5f, 0.7f, 0.2f) * (0.25f + 0.6f * light);
                picture.mask(x, y) = 255;
            }
        }
    }
    return picture;
}

std::vector<Ball> grapes() {
    return {{Vec3f(80, -80, 0), 40},
            {Vec3f(150, -75, -10), 42},
            {Vec3f(115, -130, 34), 38},
            {Vec3f(185, -135, 10), 36},
            {Vec3f(60, -150, 5), 34}};
}

TEST(Balls, ClusterIsFoundAndStacked) {
    const std::vector<Ball> truth = grapes();
    const Picture picture = picture_of(truth);
    const std::vector<Ball> found = find_balls(picture.shown, picture.mask);
    ASSERT_GE(found.size(), 4u);
    int matched = 0;
    for (const Ball& ball : found) {
        for (const Ball& other : truth) {
            const Vec3f apart = ball.centre_px - other.centre_px;
            if (apart.head<2>().norm() < 3 && std::abs(ball.radius_px - other.radius_px) < 3)
                ++matched;
        }
    }
    EXPECT_EQ(matched, static_cast<int>(found.size()));
    // The ball in the middle hides the two above it.
    const auto height_at = [&](float x, float y) {
        for (const Ball& ball : found)
            if ((ball.centre_px.head<2>() - Vec2f(x, -y)).norm() < 4) return ball.centre_px.z();
        return -1e30f;
    };
    EXPECT_GT(height_at(115, 130), height_at(80, 80) + 10);

    const Relief relief = relief_of_balls(picture.mask, found);
    double error = 0, count = 0;
    for (int y = 0; y < relief.mask.height(); ++y) {
        for (int x = 0; x < relief.mask.width(); ++x) {
            const Vec3f v(static_cast<float>(x) - 115, static_cast<float>(-y) + 130, 0);
            const float rest = 38.0f * 38.0f - v.squaredNorm();
            if (rest < 100) continue;
            const Vec3f n = (v + Vec3f(0, 0, std::sqrt(rest))) / 38;
            error += angle_between(relief.normals(x, y).cast<double>(), n.cast<double>());
            count += 1;
        }
    }
    EXPECT_LT(degrees(error / count), 5);
}

TEST(Balls, OvalOutlinesAreMeasured) {
    constexpr float kTall = 1.04f;
    const Picture picture = picture_of(grapes(), kTall);
    const std::vector<Ball> found = find_balls(picture.shown, picture.mask);
    ASSERT_GE(found.size(), 4u);
    int at_border = 0;  // the one in the middle has no border of its own
    for (const Ball& ball : found) {
        if ((ball.centre_px.head<2>() - Vec2f(115, -130)).norm() < 15) continue;
        EXPECT_NEAR(ball.oval.x(), 1 - kTall, 0.02);
        EXPECT_NEAR(ball.oval.y(), 0, 0.02);
        ++at_border;
    }
    EXPECT_GE(at_border, 4);
    const Relief relief = relief_of_balls(picture.mask, found);
    double oval_error = 0, round_error = 0, count = 0;
    for (int y = 0; y < relief.mask.height(); ++y) {
        for (int x = 0; x < relief.mask.width(); ++x) {
            const Vec2f at(static_cast<float>(x) - 185, static_cast<float>(-y) + 135);
            const Vec2f v(at.x() * kTall, at.y() / kTall);
            const float rest = 36.0f * 36.0f - v.squaredNorm();
            if (rest < 300 || at.squaredNorm() > 900) continue;
            const Vec3f n = Vec3f(v.x() * kTall, v.y() / kTall, std::sqrt(rest)).normalized();
            const Vec3f round(at.x(), at.y(), std::sqrt(36.0f * 36.0f - at.squaredNorm()));
            oval_error += angle_between(relief.normals(x, y).cast<double>(), n.cast<double>());
            round_error += angle_between(round.cast<double>(), n.cast<double>());
            count += 1;
        }
    }
    EXPECT_LT(oval_error, 0.7 * round_error);
    EXPECT_LT(degrees(oval_error / count), 2.5);
}

TEST(Balls, ABunchGoesOnBehindWhatIsSeen) {
    // Two balls make the outline; the one before them has a likeness as far behind.
    const std::vector<Ball> balls = {
        {Vec3f(85, -100, 0), 50}, {Vec3f(165, -100, 0), 50}, {Vec3f(125, -100, 50), 25}};
    const Relief relief = relief_of_balls(picture_of(balls).mask, balls);
    ASSERT_EQ(relief.unseen_balls.size(), 1u);
    EXPECT_LT((relief.unseen_balls[0].centre_px - Vec3f(125, -100, -50)).norm(), 2);
    EXPECT_EQ(relief.balls.size(), 3u);
}

TEST(Balls, OneBodyIsNoCluster) {
    Picture picture = picture_of({{Vec3f(130, -110, 0), 90}});
    EXPECT_TRUE(find_balls(picture.shown, picture.mask).empty());
    // Bumps in the shading do not make it one.
    for (int y = 0; y < picture.mask.height(); ++y) {
        for (int x = 0; x < picture.mask.width(); ++x) {
            if (is_inside(picture.mask, x, y))
                picture.shown(x, y) *=
                    1 + 0.15f * static_cast<float>(std::sin(0.11 * x) * std::cos(0.13 * y));
        }
    }
    EXPECT_TRUE(find_balls(picture.shown, picture.mask).empty());
}

}  // namespace
}  // namespace vitrine
