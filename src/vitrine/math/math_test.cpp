#include "base/rng.h"
#include "math/rigid3.h"
#include "math/sampling.h"
#include "math/sampling_steps.h"
#include "math/statistics.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(Rigid3, ProductAndInverse) {
    const Rigid3 b_from_a{Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
                          Vec3(1, 2, 3)};
    const Rigid3 c_from_b{Eigen::AngleAxisd(-1.1, Vec3(0, 1, 1).normalized()).toRotationMatrix(),
                          Vec3(-1, 0, 2)};
    const Vec3 point_in_a(0.2, -0.4, 0.9);
    EXPECT_LT(((c_from_b * b_from_a) * point_in_a - c_from_b * (b_from_a * point_in_a)).norm(),
              1e-14);
    EXPECT_LT((b_from_a.inverse() * (b_from_a * point_in_a) - point_in_a).norm(), 1e-14);
    EXPECT_TRUE(is_rotation(b_from_a.rotation));
}

TEST(Rigid3, LookAtPutsTheTargetOnTheAxis) {
    const Rigid3 world_from_camera = look_at(Vec3(1, -2, 1), Vec3(0, 0, 0.1), Vec3(0, 0, 1));
    const Vec3 target_in_camera = world_from_camera.inverse() * Vec3(0, 0, 0.1);
    EXPECT_NEAR(target_in_camera.x(), 0, 1e-12);
    EXPECT_NEAR(target_in_camera.y(), 0, 1e-12);
    EXPECT_GT(target_in_camera.z(), 0);
    EXPECT_LT((world_from_camera.rotation * Vec3(0, 1, 0)).z(), 0);  // image down is world down
}

TEST(Rigid3, AlignPointsRecoversTheMotion) {
    const Rigid3 truth{Eigen::AngleAxisd(2.0, Vec3(1, -1, 0.5).normalized()).toRotationMatrix(),
                       Vec3(0.1, 0.2, -0.3)};
    Rng rng(1);
    std::vector<Vec3> a, b;
    for (int i = 0; i < 10; ++i) {
        a.emplace_back(rng.next_double(), rng.next_double(), rng.next_double());
        b.push_back(truth * a.back());
    }
    const Rigid3 found = align_points(a, b);
    EXPECT_LT((found.rotation - truth.rotation).norm(), 1e-12);
    EXPECT_LT((found.translation - truth.translation).norm(), 1e-12);
}

TEST(Frame, IsOrthonormalEverywhere) {
    for (const Vec3& n : fibonacci_sphere(101)) {
        const Frame frame(n.cast<float>());
        EXPECT_NEAR(frame.tangent.dot(frame.bitangent), 0, 1e-6);
        EXPECT_NEAR(frame.tangent.cross(frame.bitangent).dot(frame.normal), 1, 1e-6);
    }
}

/// Samples agree with their density: theta x phi histogram, Pearson chi-square.
template <typename Sample>
void expect_density(const Sample& sample, double cos_min,
                    const std::function<double(double)>& fraction_above) {
    constexpr int kTheta = 11, kPhi = 16, kCount = 200000;
    std::vector<double> observed(kTheta * kPhi, 0.0), expected(kTheta * kPhi, 0.0);
    Rng rng(17);
    for (int i = 0; i < kCount; ++i) {
        const Vec3f d = sample(Vec2f(rng.next_float(), rng.next_float()));
        ASSERT_NEAR(d.norm(), 1.0f, 1e-5f);
        const double t = (1.0 - d.z()) / (1.0 - cos_min) * kTheta;
        const double p = (std::atan2(d.y(), d.x()) / (2 * kPi) + 0.5) * kPhi;
        observed[std::clamp(int(t), 0, kTheta - 1) * kPhi + std::clamp(int(p), 0, kPhi - 1)] += 1;
    }
    for (int t = 0; t < kTheta; ++t) {
        const double upper = 1 - (1 - cos_min) * t / kTheta,
                     lower = 1 - (1 - cos_min) * (t + 1) / kTheta;
        const double share = fraction_above(lower) - fraction_above(upper);
        for (int p = 0; p < kPhi; ++p) expected[t * kPhi + p] = kCount * share / kPhi;
    }
    const ChiSquareResult result = chi_square_test(observed, expected);
    EXPECT_GT(result.p_value, 0.001) << result.description;
}

TEST(Sampling, SinesOfATurn) {
    for (int k = 0; k < 100000; ++k) {
        const float turns = static_cast<float>(k) * 1e-5f;
        const SineCosine value = sine_cosine_of_turn(turns);
        ASSERT_NEAR(value.sine, std::sin(2 * kPi * turns), 2e-7) << turns;
        ASSERT_NEAR(value.cosine, std::cos(2 * kPi * turns), 2e-7) << turns;
    }
}

TEST(Sampling, DirectionsFollowTheirDensity) {
    expect_density([](const Vec2f& u) { return sample_cosine_hemisphere(u); }, 0.0,
                   [](double z) { return 1 - z * z; });
    expect_density([](const Vec2f& u) { return sample_uniform_sphere(u); }, -1.0,
                   [](double z) { return 0.5 * (1 - z); });
    expect_density([](const Vec2f& u) { return sample_uniform_cone(u, 0.9f); }, 0.9,
                   [](double z) { return (1 - z) / 0.1; });
}

// Shapes of the plane: as many points in each cell as its share of the area.
TEST(Sampling, PlaneShapesAreEven) {
    constexpr int kCells = 10, kCount = 100000, kSub = 40;
    const auto expect_even = [&](const auto& sample, const auto& is_inside, double area) {
        std::vector<double> observed(kCells * kCells, 0.0), expected(observed.size(), 0.0);
        Rng rng(23);
        for (int i = 0; i < kCount; ++i) {
            const Vec2f p = sample(Vec2f(rng.next_float(), rng.next_float()));
            ASSERT_TRUE(is_inside(p.x(), p.y()));
            const auto cell = [&](float v) { return std::clamp(int(v * kCells), 0, kCells - 1); };
            observed[cell(p.y()) * kCells + cell(p.x())] += 1;
        }
        for (int y = 0; y < kCells * kSub; ++y) {
            for (int x = 0; x < kCells * kSub; ++x) {
                const double step = 1.0 / (kCells * kSub);
                if (!is_inside((x + 0.5) * step, (y + 0.5) * step)) continue;
                expected[y / kSub * kCells + x / kSub] += kCount * step * step / area;
            }
        }
        const ChiSquareResult result = chi_square_test(observed, expected);
        EXPECT_GT(result.p_value, 0.001) << result.description;
    };
    expect_even(
        [](const Vec2f& u) { return Vec2f((sample_concentric_disc(u) * 0.5f).array() + 0.5f); },
        [](double x, double y) { return std::hypot(x - 0.5, y - 0.5) <= 0.5 + 1e-6; }, kPi / 4);
    expect_even([](const Vec2f& u) { return sample_triangle(u); },
                [](double x, double y) { return x + y <= 1 + 1e-6; }, 0.5);
}

TEST(Sampling, LowDiscrepancyPointsFillTheSquare) {
    // 256 points, 16 x 16 cells: Sobol hits each once; R2 and Halton leave few empty.
    std::vector<int> sobol(256, 0), r2(256, 0), halton_cells(256, 0);
    for (std::uint32_t i = 0; i < 256; ++i) {
        const auto cell = [](float x, float y) { return int(x * 16) * 16 + int(y * 16); };
        ++sobol[cell(scrambled_sobol(i, 0, 9), scrambled_sobol(i, 1, 9))];
        EXPECT_EQ(scrambled_sobol_pair(i, 9),
                  Vec2f(scrambled_sobol(i, 0, 9), scrambled_sobol(i, 1, 9)));
        const Vec2f p = r2_point(i);
        ++r2[cell(p.x(), p.y())];
        ++halton_cells[cell(halton(i, 0), halton(i, 1))];
    }
    EXPECT_EQ(std::count(sobol.begin(), sobol.end(), 1), 256);
    EXPECT_LT(std::count(r2.begin(), r2.end(), 0), 60);
    EXPECT_LT(std::count(halton_cells.begin(), halton_cells.end(), 0), 70);
}

TEST(Sampling, DiscreteDistributionMatchesItsWeights) {
    const std::vector<double> weights = {1, 0, 3, 6};
    const DiscreteDistribution distribution(weights);
    std::vector<double> counts(4, 0.0);
    Rng rng(5);
    for (int i = 0; i < 100000; ++i) {
        float u = rng.next_float();
        counts[distribution.sample(u)] += 1;
        ASSERT_GE(u, 0.0f);
        ASSERT_LT(u, 1.0f);
    }
    EXPECT_GT(chi_square_test(counts, std::vector<double>{1e4, 0, 3e4, 6e4}).p_value, 0.001);
    EXPECT_DOUBLE_EQ(distribution.probability(2), 0.3);
}

TEST(Sampling, DiscreteDistributionInvertsTheRunningSum) {
    // Weights over many orders of magnitude, with empty runs at both ends and within.
    std::vector<double> weights;
    Rng rng(6);
    for (int i = 0; i < 1000; ++i) {
        const bool is_empty = i < 50 || i >= 950 || i % 7 == 0;
        weights.push_back(is_empty ? 0.0 : std::pow(rng.next_double(), 12));
    }
    const DiscreteDistribution distribution(weights);
    double sum = 0;
    for (const double w : weights) sum += w;
    double below = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const double p = weights[i] / sum;
        EXPECT_NEAR(distribution.probability(i), p, 1e-12);
        float u = static_cast<float>(below + 0.5 * p);
        if (p > 1e-5) {
            EXPECT_EQ(distribution.sample(u), i);
        }
        below += p;
    }
    EXPECT_TRUE(DiscreteDistribution().empty());
}

}  // namespace
}  // namespace vitrine
