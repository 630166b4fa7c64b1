#include "perception/direct_likelihood.h"

#include "perception/observer_model.h"

#include <cmath>

namespace vitrine {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Unnormalised scale without its first, zero entry: psi / sigma.
VectorXd beta_of(const VectorXd& parameters) {
    VectorXd beta = parameters;
    beta[beta.size() - 1] = 1.0;
    return beta * std::exp(-parameters[parameters.size() - 1]);
}

/// Negative log-likelihood and its gradient in (psi_2 .. psi_{N-1}, log sigma).
double objective(const BinomialData& data, double lapse, const VectorXd& parameters,
                 VectorXd* gradient) {
    const VectorXd beta = beta_of(parameters);
    const VectorXd eta = data.design * beta;
    double value = 0;
    VectorXd score(eta.size());
    for (Eigen::Index i = 0; i < eta.size(); ++i) {
        const AnswerProbability a = answer_probability(eta[i], lapse);
        const double zeros = data.answers[i] - data.ones[i];
        if (data.ones[i] > 0) value -= data.ones[i] * a.log_p;
        if (zeros > 0) value -= zeros * a.log_q;
        score[i] = data.ones[i] * a.score_p - zeros * a.score_q;
    }
    if (gradient) {
        const VectorXd by_beta = data.design.transpose() * score;
        const Eigen::Index last = parameters.size() - 1;
        *gradient = -by_beta * std::exp(-parameters[last]);
        (*gradient)[last] = by_beta.dot(beta);  // d beta / d log sigma = -beta
    }
    return value;
}

}  // namespace

DirectScale fit_direct(const BinomialData& data, double lapse) {
    const Eigen::Index n = data.design.cols();
    VectorXd x(n);
    for (Eigen::Index i = 0; i + 1 < n; ++i) x[i] = static_cast<double>(i + 1) / n;
    x[n - 1] = std::log(0.2);

    VectorXd gradient(n), next_gradient(n);
    double value = objective(data, lapse, x, &gradient);
    MatrixXd inverse_hessian = MatrixXd::Identity(n, n) / std::max(1.0, gradient.norm());
    DirectScale out;
    constexpr int kMaxIterations = 1000;
    constexpr double kGradientTolerance = 1e-8;
    int idle = 0;  // steps in a row that gained nothing but rounding
    for (; out.iterations < kMaxIterations; ++out.iterations) {
        if (gradient.cwiseAbs().maxCoeff() < kGradientTolerance) break;
        VectorXd direction = -inverse_hessian * gradient;
        double slope = direction.dot(gradient);
        if (slope >= 0) {  // rounding spoiled the curvature: start it anew
            inverse_hessian.setIdentity();
            direction = -gradient;
            slope = -gradient.squaredNorm();
        }
        double step = 1.0, next = value;
        VectorXd x_next = x;
        for (; step > 1e-14; step *= 0.5) {
            x_next = x + step * direction;
            next = objective(data, lapse, x_next, &next_gradient);
            if (next <= value + 1e-4 * step * slope) break;
        }
        if (step <= 1e-14) break;  // no decrease left within rounding
        const VectorXd s = x_next - x, y = next_gradient - gradient;
        const double sy = s.dot(y);
        if (sy > 1e-12 * s.norm() * y.norm()) {
            const MatrixXd left = MatrixXd::Identity(n, n) - s * y.transpose() / sy;
            inverse_hessian = left * inverse_hessian * left.transpose() + s * s.transpose() / sy;
        }
        idle = value - next < 1e-14 * std::abs(value) ? idle + 1 : 0;
        if (idle == 5) break;
        x = x_next;
        value = next;
        gradient = next_gradient;
    }
    // A step that the line search could not improve is a minimum when the slope is only rounding.
    out.has_converged = gradient.cwiseAbs().maxCoeff() < 1e-5 && std::isfinite(value);
    out.psi.push_back(0.0);
    for (Eigen::Index i = 0; i + 1 < n; ++i) out.psi.push_back(x[i]);
    out.psi.push_back(1.0);
    out.sigma = std::exp(x[n - 1]);
    out.log_likelihood = -value;
    return out;
}

}  // namespace vitrine
