#include "math/optimise.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

TEST(Optimise, GoldenFindsAParabola) {
    const Minimum1d m =
        minimise_golden([](double x) { return (x - 0.3) * (x - 0.3); }, -1.0, 2.0, 40);
    EXPECT_NEAR(m.x, 0.3, 1e-6);
    EXPECT_FALSE(m.is_at_bound);
    EXPECT_TRUE(minimise_golden([](double x) { return x; }, 0.0, 1.0, 40).is_at_bound);
}

TEST(Optimise, GridFindsTheDeeperOfTwoBasins) {
    const auto f = [](double x) { return std::min((x + 1) * (x + 1) + 0.1, (x - 2) * (x - 2)); };
    EXPECT_NEAR(minimise_grid_golden(f, -3.0, 3.0, 13, 40).x, 2.0, 1e-6);
}

TEST(Optimise, NelderMeadFindsRosenbrocksValley) {
    const auto f = [](const std::vector<double>& x) {
        return 100 * std::pow(x[1] - x[0] * x[0], 2) + std::pow(1 - x[0], 2);
    };
    const MinimumNd m = minimise_nelder_mead(
        f, {-1.2, 1.0}, {0.5, 0.5}, {.max_evaluations = 600, .tolerance = 1e-14, .min_size = 1e-7});
    EXPECT_NEAR(m.x[0], 1.0, 1e-4);
    EXPECT_NEAR(m.x[1], 1.0, 1e-4);
    EXPECT_TRUE(m.has_converged);
}

TEST(Optimise, NelderMeadKeepsAParameterWithStepZero) {
    const auto f = [](const std::vector<double>& x) { return x[0] * x[0] + x[1] * x[1]; };
    const MinimumNd m = minimise_nelder_mead(f, {1.0, 3.0}, {0.5, 0.0});
    EXPECT_DOUBLE_EQ(m.x[1], 3.0);
    EXPECT_NEAR(m.x[0], 0.0, 0.05);
}

}  // namespace
}  // namespace vitrine
