#include "estimate/light_combinations.h"

#include "base/rng.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

CombinationColumns random_columns(Rng& rng, int lights, int places) {
    constexpr Eigen::Index kPixels = 60;
    CombinationColumns columns;
    columns.light_count = lights;
    columns.place_count = places;
    const auto random = [&](Eigen::Index r, Eigen::Index c) {
        return Eigen::MatrixXd(
            Eigen::MatrixXd::NullaryExpr(r, c, [&] { return rng.next_double(); }));
    };
    columns.diffuse = random(kPixels, lights * places);
    for (int m = 0; m < 3; ++m) {
        // Lobes are peaked: a few bright pixels.
        columns.lobe.emplace_back(random(kPixels, lights * places).array().pow(4 + 8 * m));
    }
    return columns;
}

TEST(LightCombinations, FindsTheTrueOne) {
    Rng rng(5);
    CombinationColumns columns = random_columns(rng, 2, 5);
    const std::vector<double> intensity = {1.5, 0.7};
    columns.observed = 0.3 * (1.5 * columns.diffuse.col(3) + 0.7 * columns.diffuse.col(5 + 1)) +
                       0.2 * (1.5 * columns.lobe[1].col(3) + 0.7 * columns.lobe[1].col(5 + 1));
    const std::vector<Combination> all = score_combinations(columns, intensity);
    ASSERT_EQ(all.size(), 25u);
    const auto best =
        std::min_element(all.begin(), all.end(), [](const Combination& a, const Combination& b) {
            return a.squared_error < b.squared_error;
        });
    EXPECT_EQ(best->place, (std::vector<int>{3, 1}));
    EXPECT_EQ(best->roughness, 1u);
    EXPECT_NEAR(best->rho_d, 0.3, 1e-9);
    EXPECT_NEAR(best->rho_s, 0.2, 1e-9);
    EXPECT_NEAR(best->squared_error, 0.0, 1e-9);
}

TEST(LightCombinations, AgreesWithTheSumOverPixels) {
    Rng rng(6);
    CombinationColumns columns = random_columns(rng, 3, 3);
    columns.observed =
        Eigen::VectorXd::NullaryExpr(columns.diffuse.rows(), [&] { return rng.next_double(); });
    const std::vector<double> intensity = {1.0, 0.5, 2.0};
    for (const Combination& c : score_combinations(columns, intensity)) {
        Eigen::VectorXd model = Eigen::VectorXd::Zero(columns.observed.size());
        for (std::size_t l = 0; l < 3; ++l) {
            const auto at = static_cast<Eigen::Index>(l) * 3 + c.place[l];
            model += intensity[l] * (c.rho_d * columns.diffuse.col(at) +
                                     c.rho_s * columns.lobe[c.roughness].col(at));
        }
        EXPECT_NEAR((model - columns.observed).squaredNorm(), c.squared_error, 1e-9);
        EXPECT_GE(c.rho_d, 0.0);
        EXPECT_GE(c.rho_s, 0.0);
    }
}

TEST(LightCombinations, BordersAreTheBestOneColumnFit) {
    // w points against S: only the diffuse column helps.
    const TwoColumnFit fit = fit_two_columns(1.0, 0.9, 1.0, 1.0, 0.5, 1.2);
    EXPECT_EQ(fit.s, 0.0);
    EXPECT_NEAR(fit.d, 1.0, 1e-12);
    EXPECT_NEAR(fit.squared_error, 0.2, 1e-12);
}

}  // namespace
}  // namespace vitrine
