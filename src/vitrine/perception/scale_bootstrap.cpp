#include "perception/scale_bootstrap.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/rng.h"
#include "math/statistics.h"
#include "perception/observer_model.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vitrine {
namespace {

enum Stream : std::uint64_t { kScaleStream = 1, kLambdaStream };

/// Binomial counts as sums of single answers: exact, and few per cell.
Eigen::VectorXd draw_answers(const Eigen::VectorXd& answers, const std::vector<double>& p,
                             Rng& rng) {
    Eigen::VectorXd ones(answers.size());
    for (Eigen::Index i = 0; i < answers.size(); ++i) {
        int count = 0;
        for (int k = 0; k < static_cast<int>(answers[i]); ++k) {
            count += rng.next_double() < p[static_cast<std::size_t>(i)];
        }
        ones[i] = count;
    }
    return ones;
}

struct Replicate {
    Eigen::VectorXd beta;  ///< without the leading zero
    bool is_separated = false;
    Threshold lambda;
};

/// A separated replicate is held by the same ridge as a separated data set. It shows in a variance
/// out of all proportion (ordinary ones are below 10), so the exact test need not run 10,000 times.
void refit_scale(const BinomialData& data, double lapse, const Eigen::VectorXd& start,
                 Replicate& replicate) {
    constexpr double kSeparationRidge = 1e-3;
    constexpr double kRunawayVariance = 1e3;
    ProbitFit fit =
        fit_probit(data, {.lapse = lapse, .max_iterations = 30, .tolerance = 1e-7}, &start);
    if (!fit.has_converged || fit.covariance.diagonal().maxCoeff() > kRunawayVariance) {
        replicate.is_separated = true;
        fit = fit_probit(data, {.lapse = lapse, .ridge = kSeparationRidge, .tolerance = 1e-8});
    }
    replicate.beta = fit.beta;
}

std::vector<double> collect(const std::vector<Replicate>& replicates, const auto& value) {
    std::vector<double> values;
    values.reserve(replicates.size());
    for (const Replicate& r : replicates) values.push_back(value(r));
    return values;
}

/// Gradient of a threshold by the coefficients of the smooth scale, by central differences.
Eigen::VectorXd threshold_gradient(const SmoothScale& smooth, std::span<const double> stimuli,
                                   const auto& value) {
    Eigen::VectorXd gradient(smooth.coefficients.size());
    for (Eigen::Index i = 0; i < gradient.size(); ++i) {
        const double step = 1e-4 * std::max(1.0, std::abs(smooth.coefficients[i]));
        SmoothScale up = smooth, down = smooth;
        up.coefficients[i] += step;
        down.coefficients[i] -= step;
        const double difference =
            value(threshold_of(up, stimuli)) - value(threshold_of(down, stimuli));
        gradient[i] = std::isfinite(difference) ? difference / (2 * step) : 0.0;
    }
    return gradient;
}

}  // namespace

Interval bca_interval(double estimate, std::vector<double> replicates, double acceleration,
                      double level) {
    VITRINE_CHECK(!replicates.empty());
    std::sort(replicates.begin(), replicates.end());
    const double count = static_cast<double>(replicates.size());
    const auto below = std::lower_bound(replicates.begin(), replicates.end(), estimate);
    const auto not_above = std::upper_bound(replicates.begin(), replicates.end(), estimate);
    const double share = (0.5 * static_cast<double>(below - replicates.begin()) +
                          0.5 * static_cast<double>(not_above - replicates.begin())) /
                         count;
    // An estimate outside its own replicates would put both limits at one end: keep half a count.
    const double z0 = normal_quantile(std::clamp(share, 0.5 / count, 1 - 0.5 / count));
    const auto limit = [&](double alpha) {
        const double z = z0 + normal_quantile(alpha);
        const double q = normal_cdf(z0 + z / (1 - acceleration * z));
        // Between order statistics, but never between a number and infinity.
        const double at = std::clamp(q * (count + 1) - 1, 0.0, count - 1);
        const auto i = static_cast<std::size_t>(at);
        const double low = replicates[i];
        const double high = replicates[std::min(i + 1, replicates.size() - 1)];
        const double f = at - static_cast<double>(i);
        return std::isfinite(high) && std::isfinite(low) ? low + f * (high - low)
                                                         : (f < 0.5 ? low : high);
    };
    return {limit((1 - level) / 2), limit((1 + level) / 2)};
}

double acceleration_of(const BinomialData& data, const Eigen::VectorXd& coefficients,
                       const Eigen::VectorXd& gradient, double lapse) {
    const Eigen::VectorXd eta = data.design * coefficients;
    Eigen::VectorXd weight(eta.size()), third(eta.size());
    for (Eigen::Index i = 0; i < eta.size(); ++i) {
        const AnswerProbability a = answer_probability(eta[i], lapse);
        weight[i] = data.answers[i] * a.information();
        // E[score^3] of one answer: p s_p^3 - q s_q^3.
        third[i] = data.answers[i] * (std::exp(a.log_p) * std::pow(a.score_p, 3) -
                                      std::exp(a.log_q) * std::pow(a.score_q, 3));
    }
    const Eigen::MatrixXd information = data.design.transpose() * weight.asDiagonal() * data.design;
    const Eigen::LDLT<Eigen::MatrixXd> solver(information);
    if (solver.info() != Eigen::Success || !solver.isPositive()) return 0.0;
    const Eigen::VectorXd direction = data.design * solver.solve(gradient);
    const double variance = direction.cwiseAbs2().dot(weight);
    if (!(variance > 0)) return 0.0;
    return direction.array().cube().matrix().dot(third) / (6 * std::pow(variance, 1.5));
}

ScaleBootstrap bootstrap_scale(const QuestionCells& cells, const DifferenceScale& scale,
                               const SmoothFitter& fitter, const SmoothScale& smooth,
                               std::span<const double> stimuli, const BootstrapOptions& options,
                               const Progress& progress) {
    const auto n = static_cast<std::size_t>(cells.stimulus_count);
    const Eigen::VectorXd start =
        Eigen::Map<const Eigen::VectorXd>(scale.beta.data() + 1, static_cast<Eigen::Index>(n) - 1);
    std::vector<double> p_scale;
    for (const Quadruple& q : cells.rank) {
        p_scale.push_back(probability_of_one(decision_variable(scale.beta, q), scale.lapse));
    }
    const std::vector<double> p_lambda = fitter.probabilities(smooth);

    SmoothFitter refitter = fitter;
    refitter.start_from(cells.data.ones);
    std::vector<Replicate> replicates(static_cast<std::size_t>(options.replicates));
    const auto run = [&](std::size_t begin, std::size_t end) {
        parallel_for(end - begin, 16, [&](std::size_t offset) {
            const std::size_t r = begin + offset;
            Replicate& replicate = replicates[r];
            if (options.want_scale) {
                Rng rng(stream_key(options.seed, kScaleStream, r));
                BinomialData data = cells.data;
                data.ones = draw_answers(data.answers, p_scale, rng);
                refit_scale(data, scale.lapse, start, replicate);
            }
            Rng rng(stream_key(options.seed, kLambdaStream, r));
            replicate.lambda = threshold_of(
                refitter.fit(draw_answers(cells.data.answers, p_lambda, rng)), stimuli);
        });
    };
    constexpr std::size_t kChunk = 1000;  // between two looks at the progress
    for (std::size_t begin = 0; begin < replicates.size(); begin += kChunk) {
        progress.update(static_cast<double>(begin) / static_cast<double>(replicates.size()),
                        "bootstrap");
        run(begin, std::min(replicates.size(), begin + kChunk));
    }

    ScaleBootstrap out;
    out.replicates = options.replicates;
    const Eigen::Index last = static_cast<Eigen::Index>(n) - 2;
    if (options.want_scale) {
        for (const Replicate& r : replicates) out.separated_replicates += r.is_separated;
        const auto interval = [&](double estimate, const Eigen::VectorXd& gradient,
                                  const auto& value) {
            return bca_interval(estimate, collect(replicates, value),
                                acceleration_of(cells.data, start, gradient, scale.lapse),
                                options.level);
        };
        out.beta.push_back({0, 0});
        out.psi.push_back({0, 0});
        for (Eigen::Index k = 0; k <= last; ++k) {
            Eigen::VectorXd gradient = Eigen::VectorXd::Unit(last + 1, k);
            out.beta.push_back(
                interval(start[k], gradient, [k](const Replicate& r) { return r.beta[k]; }));
            if (k == last) break;
            gradient /= start[last];
            gradient[last] = -start[k] / (start[last] * start[last]);
            out.psi.push_back(interval(start[k] / start[last], gradient, [k, last](const auto& r) {
                return r.beta[k] / r.beta[last];
            }));
        }
        out.psi.push_back({1, 1});
        Eigen::VectorXd gradient = Eigen::VectorXd::Zero(last + 1);
        gradient[last] = -1 / (start[last] * start[last]);
        out.sigma = interval(1 / start[last], gradient,
                             [last](const Replicate& r) { return 1 / r.beta[last]; });
    }

    const Threshold threshold = threshold_of(smooth, stimuli);
    BinomialData smooth_data = cells.data;
    smooth_data.design = fitter.design(smooth);
    const auto interval = [&](double estimate, const auto& value) {
        if (!std::isfinite(estimate)) return Interval{0, kNoThreshold};
        const double a = acceleration_of(smooth_data, smooth.coefficients,
                                         threshold_gradient(smooth, stimuli, value), scale.lapse);
        return bca_interval(
            estimate, collect(replicates, [&](const Replicate& r) { return value(r.lambda); }), a,
            options.level);
    };
    out.lambda = interval(threshold.value, [](const Threshold& t) { return t.value; });
    for (std::size_t i = 0; i < n; ++i) {
        out.local_lambda.push_back(
            interval(threshold.local[i][1], [i](const Threshold& t) { return t.local[i][1]; }));
    }
    return out;
}

}  // namespace vitrine
