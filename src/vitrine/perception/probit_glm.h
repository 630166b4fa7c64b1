// perception/probit_glm.h: binomial regression with a probit link, the engine of difference
// scaling (Knoblauch and Maloney 2008): P(1 | row x) = lapse / 2 + (1 - lapse) Phi(x . beta).
#pragma once

#include <Eigen/Core>

namespace vitrine {

/// Equal questions are one row: `answers[i]` of them were asked, `ones[i]` answered 1.
struct BinomialData {
    Eigen::MatrixXd design;  ///< rows x parameters
    Eigen::VectorXd answers, ones;
};

struct ProbitOptions {
    double lapse = 0.0;        ///< known share of random answers
    double ridge = 0.0;        ///< penalty ridge / 2 * |beta|^2; only where separation is known
    int max_iterations = 100;  ///< ten are usual; separated data never settles
    double tolerance = 1e-12;  ///< on the Newton decrement g' H^-1 g, i.e. twice the log-likelihood
                               ///< still to be gained
};

struct ProbitFit {
    Eigen::VectorXd beta;
    Eigen::MatrixXd covariance;  ///< inverse expected information; empty when it is singular
    double log_likelihood = 0;   ///< of the single answers (no binomial coefficients), no penalty
    int iterations = 0;
    bool has_converged = false;
    bool is_singular = false;  ///< the design does not fix all parameters
};

double probit_log_likelihood(const BinomialData& data, const Eigen::VectorXd& beta, double lapse);

/// Fisher scoring (= iteratively reweighted least squares) with step halving, from `start` or from
/// zero. Cost: rows * parameters^2 per iteration; 0.1 ms for 210 rows and 9 parameters.
ProbitFit fit_probit(const BinomialData& data, const ProbitOptions& options = {},
                     const Eigen::VectorXd* start = nullptr);

/// True when some direction b answers every question rightly or not at all (complete or
/// quasi-complete separation: no finite maximum exists; Albert and Anderson 1984). Exact, by the
/// dual (Stiemke): overlap means positive weights w with sum_i w_i z_i = 0, z_i = +-x_i, found by
/// non-negative least squares (Lawson and Hanson 1974).
/// @param direction receives such a b, scaled to largest entry 1, when there is one
bool is_separated(const BinomialData& data, Eigen::VectorXd* direction = nullptr);

}  // namespace vitrine
