#include "math/statistics.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(Statistics, NormalAndItsInverse) {
    EXPECT_NEAR(normal_cdf(1.959963984540054), 0.975, 1e-15);
    for (const double p : {1e-10, 0.001, 0.3, 0.5, 0.8, 0.9999}) {
        EXPECT_NEAR(normal_cdf(normal_quantile(p)), p, 1e-13 + 1e-12 * p);
    }
}

TEST(Statistics, ChiSquareTable) {
    EXPECT_NEAR(chi_square_cdf(3.841458820694124, 1), 0.95, 1e-12);
    EXPECT_NEAR(chi_square_cdf(124.342113404004, 100), 0.95, 1e-10);
    EXPECT_NEAR(chi_square_cdf(70.0648949253, 100), 0.01, 1e-8);
}

TEST(Statistics, PearsonRejectsAWrongDensity) {
    const std::vector<double> expected(20, 100.0);
    std::vector<double> fair(20, 100.0), biased(20, 100.0);
    for (int i = 0; i < 20; ++i) {
        fair[i] += i % 2 ? 8 : -8;
        biased[i] += i % 2 ? 25 : -25;
    }
    EXPECT_GT(chi_square_test(fair, expected).p_value, 0.5);
    EXPECT_LT(chi_square_test(biased, expected).p_value, 1e-6);
}

TEST(Statistics, RobustSummaries) {
    EXPECT_DOUBLE_EQ(median({3, 1, 2, 100}), 2.5);
    EXPECT_DOUBLE_EQ(quantile({0, 10}, 0.25), 2.5);
    const std::vector<double> values = {1, 2, 10}, weights = {1, 1, 5};
    EXPECT_DOUBLE_EQ(weighted_median(values, weights), 10);
    EXPECT_NEAR(sidak(0.01, 100), 1.005e-4, 1e-6);
}

}  // namespace
}  // namespace vitrine
