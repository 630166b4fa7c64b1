// math/qmr.h: the quasi-minimal residual method for square linear systems.
#pragma once

#include <Eigen/Core>

namespace vitrine {

struct QmrOptions {
    double tolerance = 1e-10;  ///< stop when |b - A x| <= tolerance |b|
    int max_iterations = 500;
};

struct QmrResult {
    Eigen::VectorXd x;
    int iterations = 0;
    double relative_residual = 1.0;  ///< true |b - A x| / |b|
    bool is_converged = false;       ///< false also after a Lanczos breakdown (no look-ahead)
};

/// Solves A x = b by QMR with coupled two-term recurrences (Freund and Nachtigal 1991, 1994, in
/// the form of Barrett et al. 1994, "Templates", Fig. 2.8, unpreconditioned). Used where the
/// literature asks for it; `solve_nnls` is the better tool for profiles.
QmrResult solve_qmr(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                    const QmrOptions& options = {});

}  // namespace vitrine
