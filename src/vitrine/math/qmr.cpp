#include "math/qmr.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

QmrResult solve_qmr(const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const QmrOptions& options) {
    using Eigen::VectorXd;
    VITRINE_CHECK_EQ(a.rows(), a.cols());
    VITRINE_CHECK_EQ(a.rows(), b.size());
    QmrResult result;
    result.x = VectorXd::Zero(b.size());
    const double b_norm = b.norm();
    if (b_norm == 0.0) {
        result.relative_residual = 0.0;
        result.is_converged = true;
        return result;
    }
    // Symbols as in Templates, Fig. 2.8 with M1 = M2 = I: v, w the Lanczos vectors, p, q the
    // search directions, theta and gamma the quasi-minimisation.
    VectorXd r = b;
    VectorXd v = r, w = r, p, q, d, s;
    double rho = v.norm(), xi = w.norm();
    double gamma = 1.0, eta = -1.0, theta = 0.0, epsilon = 0.0;
    const double tiny = 1e-300;

    for (int i = 0; i < options.max_iterations; ++i) {
        if (std::abs(rho) < tiny || std::abs(xi) < tiny) break;
        v /= rho;
        w /= xi;
        const double delta = w.dot(v);
        if (std::abs(delta) < tiny) break;
        if (i == 0) {
            p = v;
            q = w;
        } else {
            p = v - (xi * delta / epsilon) * p;
            q = w - (rho * delta / epsilon) * q;
        }
        const VectorXd p_image = a * p;
        epsilon = q.dot(p_image);
        if (std::abs(epsilon) < tiny) break;
        const double beta = epsilon / delta;
        if (std::abs(beta) < tiny) break;
        v = p_image - beta * v;
        const double rho_next = v.norm();
        w = a.transpose() * q - beta * w;
        const double xi_next = w.norm();

        const double theta_next = rho_next / (gamma * std::abs(beta));
        const double gamma_next = 1.0 / std::sqrt(1.0 + theta_next * theta_next);
        if (gamma_next < tiny) break;
        eta = -eta * rho * gamma_next * gamma_next / (beta * gamma * gamma);
        const double carry = theta * gamma_next;
        if (i == 0) {
            d = eta * p;
            s = eta * p_image;
        } else {
            d = eta * p + carry * carry * d;
            s = eta * p_image + carry * carry * s;
        }
        result.x += d;
        r -= s;
        result.iterations = i + 1;
        theta = theta_next;
        gamma = gamma_next;
        rho = rho_next;
        xi = xi_next;
        if (r.norm() <= options.tolerance * b_norm) {
            result.is_converged = true;
            break;
        }
    }
    result.relative_residual = (b - a * result.x).norm() / b_norm;
    return result;
}

}  // namespace vitrine
