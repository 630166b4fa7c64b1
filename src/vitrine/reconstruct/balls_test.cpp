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

TEST(Balls, MostlyHiddenBallsFillTheGaps) {
    std::vector<Ball> truth = grapes();
    truth.push_back(
        {Vec3f(38, -112, -60), 38});  // a third of it shows, beside the first and the last
    const Picture picture = picture_of(truth);
    const std::vector<Ball> found = find_balls(picture.shown, picture.mask);
    const Ball* hidden = nullptr;
    for (const Ball& ball : found)
        if (ball.is_mostly_hidden) hidden = &ball;
    ASSERT_NE(hidden, nullptr);
    EXPECT_LT((hidden->centre_px - truth.back().centre_px).head<2>().norm(), 7);
    EXPECT_NEAR(hidden->radius_px, 38, 5);
    const Relief before = relief_of_balls(picture.mask, grapes());
    const Relief relief = relief_of_balls(picture.mask, found);
    const auto uncovered = [](const Relief& cluster) {
        int count = 0;
        for (std::size_t i = 0; i < cluster.mask.size(); ++i)
            count += cluster.mask[i] > 127 && cluster.ball_of[i] < 0 ? 1 : 0;
        return count;
    };
    EXPECT_LT(uncovered(relief), uncovered(before) / 3);
}

TEST(Balls, SolidBallsDoNotSinkIntoEachOther) {
    // Each before the next: the first is further before the third than touching it would ask for.
    const std::vector<Ball> truth = {{Vec3f(70, -80, 124), 40},
                                     {Vec3f(120, -80, 62), 40},
                                     {Vec3f(106, -128, 0), 40},
                                     {Vec3f(185, -110, 20), 36},
                                     {Vec3f(180, -170, 0), 34}};
    const Picture picture = picture_of(truth);
    const std::vector<Ball> found = find_balls(picture.shown, picture.mask);
    std::array<const Ball*, 3> chain{};
    for (const Ball& ball : found)
        for (std::size_t k = 0; k < chain.size(); ++k)
            if ((ball.centre_px - truth[k].centre_px).head<2>().norm() < 5) chain[k] = &ball;
    for (const Ball* ball : chain) ASSERT_NE(ball, nullptr);
    for (const auto& [front, back] : {std::pair{0, 1}, {1, 2}, {0, 2}}) {
        const Ball &a = *chain[static_cast<std::size_t>(front)],
                   &b = *chain[static_cast<std::size_t>(back)];
        EXPECT_GT(a.centre_px.z(), b.centre_px.z());
        EXPECT_GT((a.centre_px - b.centre_px).norm(), 0.93f * (a.radius_px + b.radius_px));
    }
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
