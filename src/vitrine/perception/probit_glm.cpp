#include "perception/probit_glm.h"

#include "base/error.h"
#include "math/nnls.h"
#include "perception/observer_model.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <vector>

namespace vitrine {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Log-likelihood (less the penalty), its gradient and the expected information at one beta.
class Expansion {
  public:
    Expansion(const BinomialData& data, const ProbitOptions& options)
        : data_(data), options_(options), score_(data.design.rows()), root_(data.design.rows()) {}

    void at(const VectorXd& beta) {
        eta_.noalias() = data_.design * beta;
        value = -0.5 * options_.ridge * beta.squaredNorm();
        for (Eigen::Index i = 0; i < eta_.size(); ++i) {
            const AnswerProbability a = answer_probability(eta_[i], options_.lapse);
            const double zeros = data_.answers[i] - data_.ones[i];
            if (data_.ones[i] > 0) value += data_.ones[i] * a.log_p;
            if (zeros > 0) value += zeros * a.log_q;
            score_[i] = data_.ones[i] * a.score_p - zeros * a.score_q;
            root_[i] = std::sqrt(data_.answers[i] * a.information());
        }
    }
    void differentiate(const VectorXd& beta) {
        gradient.noalias() = data_.design.transpose() * score_ - options_.ridge * beta;
        weighted_.noalias() = root_.asDiagonal() * data_.design;
        information.setZero(beta.size(), beta.size());
        information.selfadjointView<Eigen::Lower>().rankUpdate(weighted_.transpose());
        information.diagonal().array() += options_.ridge;
    }

    double value = 0;
    VectorXd gradient;
    MatrixXd information;  ///< lower triangle

  private:
    const BinomialData& data_;
    const ProbitOptions& options_;
    VectorXd eta_, score_, root_;
    MatrixXd weighted_;
};

}  // namespace

double probit_log_likelihood(const BinomialData& data, const VectorXd& beta, double lapse) {
    const VectorXd eta = data.design * beta;
    double sum = 0;
    for (Eigen::Index i = 0; i < eta.size(); ++i) {
        const AnswerProbability a = answer_probability(eta[i], lapse);
        const double zeros = data.answers[i] - data.ones[i];
        if (data.ones[i] > 0) sum += data.ones[i] * a.log_p;
        if (zeros > 0) sum += zeros * a.log_q;
    }
    return sum;
}

ProbitFit fit_probit(const BinomialData& data, const ProbitOptions& options,
                     const VectorXd* start) {
    VITRINE_CHECK_EQ(data.design.rows(), data.answers.size());
    VITRINE_CHECK_EQ(data.design.rows(), data.ones.size());
    const Eigen::Index count = data.design.cols();
    ProbitFit fit;
    fit.beta = start ? *start : VectorXd::Zero(count);
    Expansion e(data, options);
    e.at(fit.beta);
    Eigen::LDLT<MatrixXd> solver;
    VectorXd next(count);
    for (; fit.iterations < options.max_iterations; ++fit.iterations) {
        e.differentiate(fit.beta);
        solver.compute(e.information);
        // Relative to the largest pivot: 1e-13 is the rounding of the normal matrix itself.
        const auto pivots = solver.vectorD().array();
        if (solver.info() != Eigen::Success || pivots.minCoeff() <= 1e-13 * pivots.maxCoeff()) {
            fit.is_singular = true;
            break;
        }
        VectorXd step = solver.solve(e.gradient);
        const double before = e.value;
        fit.has_converged = step.dot(e.gradient) < options.tolerance;
        next = fit.beta + step;
        e.at(next);
        // Near the maximum the value only rounds: the last full step is right as it is.
        for (int halving = 0; halving < 30 && !fit.has_converged && !(e.value >= before);
             ++halving) {
            step *= 0.5;
            next = fit.beta + step;
            e.at(next);
        }
        fit.beta = next;
        if (fit.has_converged) break;
    }
    fit.log_likelihood = e.value + 0.5 * options.ridge * fit.beta.squaredNorm();
    if (!fit.is_singular) fit.covariance = solver.solve(MatrixXd::Identity(count, count));
    return fit;
}

bool is_separated(const BinomialData& data, VectorXd* direction) {
    // A row answered both ways counts in both directions.
    std::vector<VectorXd> signed_rows;
    for (Eigen::Index i = 0; i < data.design.rows(); ++i) {
        if (data.ones[i] > 0) signed_rows.emplace_back(data.design.row(i));
        if (data.ones[i] < data.answers[i]) signed_rows.emplace_back(-data.design.row(i));
    }
    if (signed_rows.empty()) return true;
    MatrixXd z(data.design.cols(), static_cast<Eigen::Index>(signed_rows.size()));
    for (std::size_t i = 0; i < signed_rows.size(); ++i) {
        z.col(static_cast<Eigen::Index>(i)) = signed_rows[i];
    }
    // Weights w = 1 + v, v >= 0: sum w_i z_i = 0 is solvable exactly when the data overlap. The
    // residual of the least squares is a separating direction.
    const VectorXd target = -z.rowwise().sum();
    const VectorXd v = solve_nnls(z, target).x;
    const VectorXd residual = z * v - target;
    const double size = residual.cwiseAbs().maxCoeff();
    if (size < 1e-6) return false;
    if (direction) *direction = residual / size;
    return true;
}

}  // namespace vitrine
