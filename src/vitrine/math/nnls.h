// math/nnls.h: least squares with non-negative unknowns.
#pragma once

#include <Eigen/Core>

namespace vitrine {

struct NnlsResult {
    Eigen::VectorXd x;           ///< >= 0
    int iterations = 0;          ///< changes of the set of positive unknowns
    bool is_converged = false;   ///< false when the iteration limit was hit; x is still feasible
    double kkt_violation = 0.0;  ///< see `nnls_kkt_violation`
};

/// Minimises |A x - b|^2 over x >= 0 by active sets (Lawson and Hanson 1974, ch. 23), with a QR
/// factorisation of the positive columns in each round. Exact up to rounding; cost about
/// (number of positive unknowns) factorisations.
NnlsResult solve_nnls(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// The same from the normal equations G = A^T A, h = A^T b (Bro and de Jong 1997): faster when A is
/// tall, with the squared condition number.
NnlsResult solve_nnls_gram(const Eigen::MatrixXd& gram, const Eigen::VectorXd& atb);

/// How far x is from the optimum, relative to max |h|: the worst of -x_i, a gradient
/// h - G x above 0 where x = 0, and a gradient other than 0 where x > 0. 0 at the minimum.
double nnls_kkt_violation(const Eigen::MatrixXd& gram, const Eigen::VectorXd& atb,
                          const Eigen::VectorXd& x);

}  // namespace vitrine
