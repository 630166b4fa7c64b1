#include "math/nnls.h"

#include "base/error.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Unconstrained solution over the columns in `positive`.
using PassiveSolver = std::function<VectorXd(const std::vector<Index>& positive)>;

/// The loop shared by both forms. `gradient(x)` is A^T (b - A x).
NnlsResult active_set(Index count, double tolerance,
                      const std::function<VectorXd(const VectorXd&)>& gradient,
                      const PassiveSolver& solve_passive) {
    NnlsResult result;
    result.x = VectorXd::Zero(count);
    std::vector<bool> is_positive(static_cast<std::size_t>(count), false);
    // A column that could not become positive after it was let in (rounding between nearly equal
    // columns) is not let in again before something else moved: this is what prevents cycling.
    std::vector<bool> is_barred(static_cast<std::size_t>(count), false);
    const int limit = static_cast<int>(3 * count + 10);

    const auto positive_set = [&] {
        std::vector<Index> set;
        for (Index i = 0; i < count; ++i)
            if (is_positive[static_cast<std::size_t>(i)]) set.push_back(i);
        return set;
    };

    for (; result.iterations < limit; ++result.iterations) {
        const VectorXd w = gradient(result.x);
        Index entering = -1;
        double steepest = tolerance;
        for (Index i = 0; i < count; ++i) {
            const auto k = static_cast<std::size_t>(i);
            if (!is_positive[k] && !is_barred[k] && w[i] > steepest) {
                steepest = w[i];
                entering = i;
            }
        }
        if (entering < 0) {
            result.is_converged = true;
            break;
        }
        is_positive[static_cast<std::size_t>(entering)] = true;

        bool is_first_pass = true;
        while (true) {
            const std::vector<Index> set = positive_set();
            if (set.empty()) break;
            const VectorXd z = solve_passive(set);
            double step = 1.0;
            Index blocking = -1;
            for (std::size_t k = 0; k < set.size(); ++k) {
                const double x = result.x[set[k]];
                const double target = z[static_cast<Index>(k)];
                if (target > 0) continue;
                const double fraction = x > 0 ? x / (x - target) : 0.0;
                if (blocking < 0 || fraction < step) {
                    step = fraction;
                    blocking = set[k];
                }
            }
            if (blocking < 0) {
                result.x.setZero();
                for (std::size_t k = 0; k < set.size(); ++k)
                    result.x[set[k]] = z[static_cast<Index>(k)];
                std::fill(is_barred.begin(), is_barred.end(), false);
                break;
            }
            if (is_first_pass && blocking == entering && step == 0.0) {
                is_positive[static_cast<std::size_t>(entering)] = false;
                is_barred[static_cast<std::size_t>(entering)] = true;
                break;
            }
            is_first_pass = false;
            for (std::size_t k = 0; k < set.size(); ++k) {
                double& x = result.x[set[k]];
                x += step * (z[static_cast<Index>(k)] - x);
                if (set[k] == blocking || x <= 0) {
                    x = 0;
                    is_positive[static_cast<std::size_t>(set[k])] = false;
                }
            }
        }
    }
    return result;
}

}  // namespace

NnlsResult solve_nnls(const MatrixXd& a, const VectorXd& b) {
    VITRINE_CHECK_EQ(a.rows(), b.size());
    const VectorXd atb = a.transpose() * b;
    const double tolerance = 1e-12 * std::max(atb.cwiseAbs().maxCoeff(), 1e-300);
    NnlsResult result = active_set(
        a.cols(), tolerance,
        [&](const VectorXd& x) -> VectorXd { return a.transpose() * (b - a * x); },
        [&](const std::vector<Index>& set) -> VectorXd {
            MatrixXd columns(a.rows(), static_cast<Index>(set.size()));
            for (std::size_t k = 0; k < set.size(); ++k)
                columns.col(static_cast<Index>(k)) = a.col(set[k]);
            return columns.colPivHouseholderQr().solve(b);
        });
    result.kkt_violation = nnls_kkt_violation(a.transpose() * a, atb, result.x);
    return result;
}

NnlsResult solve_nnls_gram(const MatrixXd& gram, const VectorXd& atb) {
    VITRINE_CHECK_EQ(gram.rows(), gram.cols());
    VITRINE_CHECK_EQ(gram.rows(), atb.size());
    const double tolerance = 1e-11 * std::max(atb.cwiseAbs().maxCoeff(), 1e-300);
    NnlsResult result = active_set(
        gram.cols(), tolerance, [&](const VectorXd& x) -> VectorXd { return atb - gram * x; },
        [&](const std::vector<Index>& set) -> VectorXd {
            const auto n = static_cast<Index>(set.size());
            MatrixXd g(n, n);
            VectorXd h(n);
            for (Index i = 0; i < n; ++i) {
                h[i] = atb[set[static_cast<std::size_t>(i)]];
                for (Index j = 0; j < n; ++j) {
                    g(i, j) =
                        gram(set[static_cast<std::size_t>(i)], set[static_cast<std::size_t>(j)]);
                }
            }
            return g.ldlt().solve(h);
        });
    result.kkt_violation = nnls_kkt_violation(gram, atb, result.x);
    return result;
}

double nnls_kkt_violation(const MatrixXd& gram, const VectorXd& atb, const VectorXd& x) {
    const VectorXd w = atb - gram * x;
    const double scale = std::max(atb.cwiseAbs().maxCoeff(), 1e-300);
    double worst = 0.0;
    for (Index i = 0; i < x.size(); ++i) {
        worst = std::max(worst, -x[i]);
        worst = std::max(worst, (x[i] > 0 ? std::abs(w[i]) : std::max(w[i], 0.0)) / scale);
    }
    return worst;
}

}  // namespace vitrine
