#include "estimate/ward_bound.h"

#include "base/parallel.h"
#include "estimate/light_combinations.h"
#include "math/optimise.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace vitrine {

namespace {

double inverse_square(double sigma) { return 1.0 / (sigma * sigma); }

/// Lobe of every pixel per unit rho_s, lowest and highest over u in [u_low, u_high].
struct LobeRange {
    std::vector<Rgbd> low, high;
};

LobeRange lobe_range(const WardProblem& p, double u_low, double u_high) {
    LobeRange range;
    range.low = range.high = p.held;
    parallel_for(p.size(), 128, [&](std::size_t x) {
        for (std::size_t k = p.first_term[x]; k < p.first_term[x + 1]; ++k) {
            // u exp(-t u) rises up to u = 1 / t and falls from there: its least value on an
            // interval is at an end, its greatest at 1 / t or the end nearer to it.
            const double t = p.tan2[k];
            const auto phi = [t](double u) { return u * std::exp(-t * u); };
            const double at_low = phi(u_low), at_high = phi(u_high);
            const double top = t > 0.0 ? phi(std::clamp(1.0 / t, u_low, u_high)) : at_high;
            const Rgbd& colour = p.lamp_colour[static_cast<std::size_t>(p.lamp[k])];
            range.low[x] += p.strength[k] * std::min(at_low, at_high) * colour;
            range.high[x] += p.strength[k] * top * colour;
        }
    });
    return range;
}

/// min over d, s in [0, rho_max] of sum v dist(S - d a, [s low, s high])^2, bounded from below.
/// Convex and once differentiable in two unknowns: projected Newton, then the first-order
/// condition on the box turns wherever it stopped into a valid bound.
double channel_bound(const WardProblem& p, const LobeRange& range, int c, double rho_max) {
    Eigen::Vector2d q(0.0, 0.0);
    Eigen::Vector2d gradient;
    Eigen::Matrix2d hessian;
    const auto evaluate = [&](const Eigen::Vector2d& at, bool with_derivatives) {
        double value = 0.0;
        if (with_derivatives) {
            gradient.setZero();
            hessian.setZero();
        }
        for (std::size_t x = 0; x < p.size(); ++x) {
            const double v = p.weight[x][c];
            if (v == 0.0) continue;
            const double rest = p.observed[x][c] - at[0] * p.diffuse[x][c];
            const double below = at[1] * range.low[x][c] - rest;   // > 0: model too bright
            const double above = rest - at[1] * range.high[x][c];  // > 0: model too dark
            if (below <= 0.0 && above <= 0.0) continue;
            const bool is_bright = below > above;
            const double r = is_bright ? below : -above;
            value += v * r * r;
            if (!with_derivatives) continue;
            const Eigen::Vector2d slope(p.diffuse[x][c],
                                        is_bright ? range.low[x][c] : range.high[x][c]);
            gradient += 2.0 * v * r * slope;
            hessian += 2.0 * v * slope * slope.transpose();
        }
        return value;
    };
    double value = evaluate(q, true);
    for (int round = 0; round < 30; ++round) {
        // Unknowns held by a border whose gradient points outward stay.
        Eigen::Vector2d step = Eigen::Vector2d::Zero();
        std::array<bool, 2> is_free{};
        for (int i = 0; i < 2; ++i)
            is_free[static_cast<std::size_t>(i)] =
                !(q[i] <= 0.0 && gradient[i] > 0.0) && !(q[i] >= rho_max && gradient[i] < 0.0);
        Eigen::Matrix2d h = hessian;
        h.diagonal().array() += 1e-12 * hessian.trace() + 1e-300;
        if (is_free[0] && is_free[1]) {
            step = -h.inverse() * gradient;
        } else if (is_free[0]) {
            step[0] = -gradient[0] / h(0, 0);
        } else if (is_free[1]) {
            step[1] = -gradient[1] / h(1, 1);
        }
        double length = 1.0;
        bool has_moved = false;
        for (int halving = 0; halving < 12 && !has_moved; ++halving, length *= 0.5) {
            const Eigen::Vector2d next = (q + length * step).cwiseMax(0.0).cwiseMin(rho_max);
            const double trial = evaluate(next, false);
            if (trial < value - 1e-15 * std::abs(value)) {
                has_moved = true;
                q = next;
            }
        }
        if (!has_moved) break;
        const double last = value;
        value = evaluate(q, true);
        if (last - value < 1e-12 * value) break;
    }
    double bound = value;
    for (int i = 0; i < 2; ++i)
        bound += std::min({0.0, -gradient[i] * q[i], gradient[i] * (rho_max - q[i])});
    return std::max(0.0, bound);
}

struct Fit {
    double error = 0.0;
    std::array<double, 3> rho_d{}, rho_s{};
};

Fit fit_at(const WardProblem& p, double sigma) {
    const double u = inverse_square(sigma);
    const LobeRange lobe = lobe_range(p, u, u);
    Fit fit;
    for (int c = 0; c < 3; ++c) {
        double aa = 0, aw = 0, ww = 0, as = 0, ws = 0, ss = 0;
        for (std::size_t x = 0; x < p.size(); ++x) {
            const double v = p.weight[x][c], a = p.diffuse[x][c], w = lobe.low[x][c];
            const double s = p.observed[x][c];
            aa += v * a * a;
            aw += v * a * w;
            ww += v * w * w;
            as += v * a * s;
            ws += v * w * s;
            ss += v * s * s;
        }
        const TwoColumnFit channel = fit_two_columns(aa, aw, ww, as, ws, ss);
        fit.error += channel.squared_error;
        fit.rho_d[static_cast<std::size_t>(c)] = channel.d;
        fit.rho_s[static_cast<std::size_t>(c)] = channel.s;
    }
    return fit;
}

}  // namespace

double WardCertificate::relative_gap() const {
    return upper_bound > 0.0 ? (upper_bound - lower_bound) / upper_bound : 0.0;
}

double ward_error(const WardProblem& problem, double sigma) { return fit_at(problem, sigma).error; }

double ward_lower_bound(const WardProblem& problem, double sigma_low, double sigma_high,
                        double rho_max) {
    const LobeRange range =
        lobe_range(problem, inverse_square(sigma_high), inverse_square(sigma_low));
    double bound = 0.0;
    for (int c = 0; c < 3; ++c) bound += channel_bound(problem, range, c, rho_max);
    return bound;
}

WardCertificate certify_ward(const WardProblem& problem, const WardBoundOptions& options) {
    struct Node {
        double bound, low, high;  // low, high: log sigma
        bool operator<(const Node& other) const { return bound > other.bound; }
    };
    WardCertificate result;
    double best_log = std::log(options.sigma_min);
    const auto try_sigma = [&](double log_sigma) {
        const double error = ward_error(problem, std::exp(log_sigma));
        if (result.sigma == 0.0 || error < result.upper_bound) {
            result.upper_bound = error;
            result.sigma = std::exp(log_sigma);
            best_log = log_sigma;
        }
        return error;
    };
    std::priority_queue<Node> queue;
    const auto push = [&](double low, double high, double parent_bound) {
        ++result.nodes;
        const double bound =
            std::max(parent_bound,
                     ward_lower_bound(problem, std::exp(low), std::exp(high), options.rho_max));
        try_sigma(0.5 * (low + high));
        queue.push({bound, low, high});
    };
    const double low = std::log(options.sigma_min), high = std::log(options.sigma_max);
    const auto polish = [&] {
        const double cell = (high - low) / 32.0;
        minimise_golden(try_sigma, std::max(low, best_log - cell), std::min(high, best_log + cell),
                        32);
    };
    push(low, high, 0.0);
    minimise_grid_golden(try_sigma, low, high, 24, 8);
    polish();
    while (!queue.empty()) {
        const Node node = queue.top();
        result.lower_bound = std::min(node.bound, result.upper_bound);
        if (result.relative_gap() <= options.relative_gap) {
            result.is_complete = true;
            break;
        }
        if (result.nodes >= options.max_nodes) break;
        queue.pop();
        const double middle = 0.5 * (node.low + node.high);
        push(node.low, middle, node.bound);
        push(middle, node.high, node.bound);
    }
    polish();
    const Fit best = fit_at(problem, result.sigma);
    result.rho_d = best.rho_d;
    result.rho_s = best.rho_s;
    return result;
}

}  // namespace vitrine
