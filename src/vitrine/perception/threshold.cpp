#include "perception/threshold.h"

#include "base/error.h"
#include "perception/observer_model.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

/// t^k on [0, 1], continued straight beyond its ends.
double power(double t, int k) {
    if (k == 1) return t;
    if (t <= 0) return 0.0;
    return t <= 1 ? std::pow(t, k) : 1 + k * (t - 1);
}

/// Log-likelihood to be gained by one scoring step: g' H^-1 g / 2.
double score_gain(const Eigen::MatrixXd& design, const Eigen::VectorXd& score,
                  const Eigen::VectorXd& weight) {
    const Eigen::VectorXd gradient = design.transpose() * score;
    const Eigen::MatrixXd information = design.transpose() * weight.asDiagonal() * design;
    return 0.5 * gradient.dot(information.ldlt().solve(gradient));
}

}  // namespace

SmoothScale::SmoothScale(double begin, double end, int degree)
    : coefficients(Eigen::VectorXd::Zero(degree)), begin_(begin), end_(end) {
    VITRINE_CHECK_GE(degree, 1);
}

Eigen::VectorXd SmoothScale::basis(double n) const {
    const double t = (n - begin_) / (end_ - begin_);
    Eigen::VectorXd values(degrees_of_freedom());
    for (int k = 1; k <= degrees_of_freedom(); ++k) values[k - 1] = power(t, k);
    return values;
}

double SmoothScale::beta(double n) const {
    // The dot product of `basis` by Horner's rule: this is the inner loop of a bootstrap.
    const double t = (n - begin_) / (end_ - begin_);
    const double inside = std::clamp(t, 0.0, 1.0);
    double value = 0, slope = 0;
    for (int k = degrees_of_freedom(); k >= 1; --k) {
        slope = slope * inside + k * coefficients[k - 1];
        value = (value + coefficients[k - 1]) * inside;
    }
    return value + slope * (t - inside);
}

SmoothFitter::SmoothFitter(const QuestionCells& cells, std::span<const double> stimuli,
                           const SmoothOptions& options)
    : answers_(cells.data.answers), answer_count_(cells.data.answers.sum()), lapse_(options.lapse) {
    VITRINE_CHECK_EQ(static_cast<int>(stimuli.size()), cells.stimulus_count);
    const int most = std::min(options.max_degrees_of_freedom, cells.stimulus_count - 2);
    for (int df = 1; df <= std::max(1, most); ++df) {
        SmoothScale candidate(stimuli.front(), stimuli.back(), df);
        Eigen::MatrixXd at_stimuli(cells.stimulus_count - 1, df);
        const Eigen::VectorXd origin = candidate.basis(stimuli.front());
        for (int i = 1; i < cells.stimulus_count; ++i) {
            at_stimuli.row(i - 1) =
                (candidate.basis(stimuli[static_cast<std::size_t>(i)]) - origin).transpose();
        }
        designs_.push_back(cells.data.design * at_stimuli);
        candidates_.push_back(std::move(candidate));
    }
}

SmoothScale SmoothFitter::fit(const Eigen::VectorXd& ones) const {
    SmoothScale best = fit_candidate(0, ones);
    const double gain_per_parameter = 0.5 * std::log(std::max(1.0, answer_count_));
    const Eigen::VectorXd eta = designs_[0] * best.coefficients;
    Eigen::VectorXd score(eta.size()), weight(eta.size());
    for (Eigen::Index i = 0; i < eta.size(); ++i) {
        const AnswerProbability a = answer_probability(eta[i], lapse_);
        score[i] = ones[i] * a.score_p - (answers_[i] - ones[i]) * a.score_q;
        weight[i] = answers_[i] * a.information();
    }
    for (std::size_t i = 1; i < candidates_.size(); ++i) {
        // Every polynomial contains the line, so its score test there (Rao 1948) foretells the gain
        // in log-likelihood. Half of what the criterion asks is no hope worth a fit.
        constexpr double kHopeless = 0.5;
        const double needed = gain_per_parameter * static_cast<double>(i);
        if (score_gain(designs_[i], score, weight) < kHopeless * needed) continue;
        SmoothScale scale = fit_candidate(i, ones);
        // A fit that did not settle is no evidence for a curve.
        if (scale.has_converged && scale.bic < best.bic) best = std::move(scale);
    }
    return best;
}

SmoothScale SmoothFitter::fit_candidate(std::size_t index, const Eigen::VectorXd& ones) const {
    // A ridge far below the information of one answer keeps separated replicates finite.
    constexpr double kRidge = 1e-6;
    SmoothScale scale = candidates_[index];
    const BinomialData data{designs_[index], answers_, ones};
    const ProbitFit fit = fit_probit(
        data, {.lapse = lapse_, .ridge = kRidge, .max_iterations = 40, .tolerance = 1e-7},
        &candidates_[index].coefficients);
    scale.coefficients = fit.beta;
    scale.log_likelihood = fit.log_likelihood;
    scale.has_converged = fit.has_converged;
    scale.bic = -2 * fit.log_likelihood +
                scale.degrees_of_freedom() * std::log(std::max(1.0, answer_count_));
    return scale;
}

void SmoothFitter::start_from(const Eigen::VectorXd& ones) {
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
        const SmoothScale scale = fit_candidate(i, ones);
        if (scale.has_converged) candidates_[i].coefficients = scale.coefficients;
    }
}

const Eigen::MatrixXd& SmoothFitter::design(const SmoothScale& scale) const {
    return designs_[static_cast<std::size_t>(scale.degrees_of_freedom()) - 1];
}

std::vector<double> SmoothFitter::probabilities(const SmoothScale& scale) const {
    const Eigen::VectorXd eta = design(scale) * scale.coefficients;
    std::vector<double> p;
    for (const double e : eta) p.push_back(probability_of_one(e, lapse_));
    return p;
}

double local_threshold(const SmoothScale& scale, double n) {
    const double span = scale.end() - scale.begin();
    if (scale.degrees_of_freedom() == 1) {
        const double slope = scale.coefficients[0] / span;
        return slope > kBetaPerThreshold / (4 * span) ? kBetaPerThreshold / slope : kNoThreshold;
    }
    const auto rise = [&](double width) {
        return scale.beta(n + width / 2) - scale.beta(n - width / 2);
    };
    constexpr int kSteps = 160;
    double low = 0.0, high = 0.0;
    for (int i = 1; i <= kSteps; ++i) {
        high = 4 * span * i / kSteps;
        if (rise(high) >= kBetaPerThreshold) break;
        if (i == kSteps) return kNoThreshold;
        low = high;
    }
    for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (low + high);
        (rise(middle) >= kBetaPerThreshold ? high : low) = middle;
    }
    return 0.5 * (low + high);
}

Threshold threshold_of(const SmoothScale& scale, std::span<const double> stimuli) {
    Threshold threshold;
    for (const double n : stimuli) {
        const double local = local_threshold(scale, n);
        threshold.local.push_back({n, local});
        threshold.value = std::min(threshold.value, local);
    }
    return threshold;
}

}  // namespace vitrine
