#include "math/nnls.h"

#include "base/rng.h"
#include "math/qmr.h"

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace vitrine {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_matrix(int rows, int cols, std::uint64_t seed) {
    Rng rng(seed);
    MatrixXd m(rows, cols);
    for (int j = 0; j < cols; ++j)
        for (int i = 0; i < rows; ++i) m(i, j) = 2 * rng.next_double() - 1;
    return m;
}

TEST(Nnls, FindsANonNegativeTruth) {
    const MatrixXd a = random_matrix(60, 12, 1);
    VectorXd truth = VectorXd::Zero(12);
    truth[1] = 2.0;
    truth[7] = 0.3;
    truth[11] = 5.0;
    const NnlsResult result = solve_nnls(a, a * truth);
    EXPECT_TRUE(result.is_converged);
    EXPECT_LT((result.x - truth).norm(), 1e-10);
    EXPECT_LT((solve_nnls_gram(a.transpose() * a, a.transpose() * (a * truth)).x - truth).norm(),
              1e-9);
}

TEST(Nnls, MeetsTheKktConditions) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        const MatrixXd a = random_matrix(30, 20, 100 + seed);
        const VectorXd b = random_matrix(30, 1, 200 + seed);
        const NnlsResult result = solve_nnls(a, b);
        EXPECT_TRUE(result.is_converged);
        EXPECT_LT(result.kkt_violation, 1e-10);
        const NnlsResult gram = solve_nnls_gram(a.transpose() * a, a.transpose() * b);
        EXPECT_LT(gram.kkt_violation, 1e-9);
        EXPECT_LT((gram.x - result.x).norm(), 1e-7);
    }
}

TEST(Nnls, SurvivesEqualColumnsAndZeros) {
    MatrixXd a = random_matrix(20, 6, 7).cwiseAbs();
    a.col(3) = a.col(2);
    a.col(5).setZero();
    const VectorXd b = a.col(2) * 2.0;
    const NnlsResult result = solve_nnls(a, b);
    EXPECT_TRUE(result.is_converged);
    EXPECT_LT((a * result.x - b).norm(), 1e-9);
    EXPECT_EQ(solve_nnls(a, -b).x.norm(), 0.0);
}

TEST(Qmr, AgreesWithCholesky) {
    const MatrixXd half = random_matrix(80, 24, 3);
    const MatrixXd a = half.transpose() * half;
    const VectorXd b = random_matrix(24, 1, 4);
    const QmrResult result = solve_qmr(a, b, {.tolerance = 1e-13, .max_iterations = 400});
    const VectorXd exact = a.llt().solve(b);
    EXPECT_TRUE(result.is_converged);
    EXPECT_LT((result.x - exact).norm() / exact.norm(), 1e-8);
}

TEST(Qmr, SolvesAnUnsymmetricSystem) {
    const MatrixXd a = random_matrix(30, 30, 5) + 8.0 * MatrixXd::Identity(30, 30);
    const VectorXd truth = random_matrix(30, 1, 6);
    const QmrResult result = solve_qmr(a, a * truth, {.tolerance = 1e-12});
    EXPECT_LT((result.x - truth).norm(), 1e-9);
    EXPECT_EQ(solve_qmr(a, VectorXd::Zero(30)).x.norm(), 0.0);
}

TEST(Qmr, SaysWhenItDidNotArrive) {
    const MatrixXd half = random_matrix(80, 40, 3);
    const QmrResult result = solve_qmr(half.transpose() * half, random_matrix(40, 1, 4),
                                       {.tolerance = 1e-12, .max_iterations = 3});
    EXPECT_FALSE(result.is_converged);
    EXPECT_GT(result.relative_residual, 1e-6);
}

}  // namespace
}  // namespace vitrine
