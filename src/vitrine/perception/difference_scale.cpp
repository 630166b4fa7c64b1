#include "perception/difference_scale.h"

#include "base/error.h"
#include "base/text.h"
#include "math/statistics.h"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <map>

namespace vitrine {
namespace {

/// Holds separated fits finite without moving ordinary ones; larger values bias the threshold
/// (0.05 turned a true 0.010 into 0.0122 on nearly deterministic answers).
constexpr double kSeparationRidge = 1e-3;
/// Fewer answers per free parameter and sigma is biased by more than ten per cent.
constexpr double kMinTrialsPerParameter = 10.0;
constexpr double kMaxLapse = 0.4;
constexpr double kSignificantZ = 1.96;

std::string list_of(const std::vector<int>& ranks) {
    std::vector<std::string> words;
    for (const int r : ranks) words.push_back(std::to_string(r));
    return join(words, ", ");
}

std::vector<int> never_shown(const QuestionCells& cells) {
    std::vector<bool> seen(static_cast<std::size_t>(cells.stimulus_count) + 1, false);
    for (const Quadruple& q : cells.rank) {
        for (const int r : q) seen[static_cast<std::size_t>(r)] = true;
    }
    std::vector<int> missing;
    for (int r = 1; r <= cells.stimulus_count; ++r) {
        if (!seen[static_cast<std::size_t>(r)]) missing.push_back(r);
    }
    return missing;
}

/// Why the scale cannot be fixed by these questions, whatever the answers; empty when it can.
std::string defect_of_questions(const QuestionCells& cells) {
    const std::vector<int> missing = never_shown(cells);
    if (!missing.empty()) {
        return "stimulus " + list_of(missing) + " was never shown: its place on the scale is open";
    }
    const auto parameters = static_cast<std::size_t>(cells.data.design.cols());
    if (cells.response.size() < parameters) {
        return fmt::format("{} trials cannot fix {} scale values", cells.response.size(),
                           parameters);
    }
    if (cells.data.design.colPivHouseholderQr().rank() < cells.data.design.cols()) {
        return "the questions leave a direction of the scale open (too few different ones)";
    }
    return "";
}

std::string separation_reason(const Eigen::VectorXd& direction) {
    std::vector<int> ranks;
    for (Eigen::Index i = 0; i < direction.size(); ++i) {
        if (std::abs(direction[i]) > 1e-6) ranks.push_back(static_cast<int>(i) + 2);
    }
    return "the answers are perfectly separated along the scale values of stimulus " +
           list_of(ranks) + ": no finite estimate exists; ask more trials or choose closer stimuli";
}

void judge_ends(DifferenceScale& scale) {
    const double last = scale.beta.back(), se = scale.se_beta.back();
    if (last > kSignificantZ * se) return;
    scale.outcome = FitOutcome::NotIdentifiable;
    scale.reason = last < -kSignificantZ * se
                       ? "the scale falls: the answers look reversed (the more alike pair was "
                         "chosen, or resp 1 means the pair (S1, S2))"
                       : "the ends of the series do not differ measurably: the stimuli are too "
                         "alike or the answers are random";
}

void add_warnings(DifferenceScale& scale) {
    const double parameters = scale.stimulus_count - 1;
    if (scale.trial_count < kMinTrialsPerParameter * parameters) {
        scale.warnings.push_back(
            fmt::format("only {} trials for {} scale values: the scale is biased upwards and its "
                        "intervals are rough; {} trials or more are wanted",
                        scale.trial_count, parameters, kMinTrialsPerParameter * parameters));
    }
    for (std::size_t i = 1; i < scale.beta.size(); ++i) {
        // Neighbours' errors are positively correlated, so this is a mild criterion.
        const double drop = scale.beta[i - 1] - scale.beta[i];
        if (drop > kSignificantZ * std::hypot(scale.se_beta[i], scale.se_beta[i - 1])) {
            scale.warnings.push_back(
                fmt::format("the scale falls from stimulus {} to {}", i, i + 1));
        }
    }
}

double best_log_likelihood(const QuestionCells& cells, double lapse, double ridge) {
    return fit_probit(cells.data, {.lapse = lapse, .ridge = ridge}).log_likelihood;
}

}  // namespace

std::string outcome_name(FitOutcome outcome) {
    switch (outcome) {
        case FitOutcome::Converged:
            return "converged";
        case FitOutcome::AtBound:
            return "at_bound";
        case FitOutcome::NotIdentifiable:
            return "not_identifiable";
    }
    return "";
}

std::vector<double> with_leading_zero(const Eigen::VectorXd& coefficients) {
    std::vector<double> beta(static_cast<std::size_t>(coefficients.size()) + 1, 0.0);
    std::copy(coefficients.data(), coefficients.data() + coefficients.size(), beta.begin() + 1);
    return beta;
}

QuestionCells group_trials(std::span<const Trial> trials, int stimulus_count) {
    QuestionCells cells;
    cells.stimulus_count = stimulus_count;
    std::map<Quadruple, int> known;
    std::vector<double> answers, ones;
    for (const Trial& given : trials) {
        const Trial t = canonical(given);
        VITRINE_CHECK_LE(*std::max_element(t.rank.begin(), t.rank.end()), stimulus_count);
        const auto [at, is_new] = known.emplace(t.rank, static_cast<int>(cells.rank.size()));
        if (is_new) {
            cells.rank.push_back(t.rank);
            answers.push_back(0);
            ones.push_back(0);
        }
        const auto cell = static_cast<std::size_t>(at->second);
        answers[cell] += 1;
        ones[cell] += t.response;
        cells.cell_of_trial.push_back(at->second);
        cells.response.push_back(t.response);
    }
    const auto rows = static_cast<Eigen::Index>(cells.rank.size());
    cells.data.answers = Eigen::Map<const Eigen::VectorXd>(answers.data(), rows);
    cells.data.ones = Eigen::Map<const Eigen::VectorXd>(ones.data(), rows);
    cells.data.design = Eigen::MatrixXd::Zero(rows, stimulus_count - 1);
    constexpr double kSign[4] = {1, -1, -1, 1};
    for (Eigen::Index row = 0; row < rows; ++row) {
        for (std::size_t k = 0; k < 4; ++k) {
            const int column = cells.rank[static_cast<std::size_t>(row)][k] - 2;
            if (column >= 0) cells.data.design(row, column) += kSign[k];
        }
    }
    return cells;
}

LapseTest test_for_lapses(const QuestionCells& cells) {
    // Golden section on [0, kMaxLapse]: the profile likelihood has one maximum in practice.
    const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
    double low = 0.0, high = kMaxLapse;
    const auto value = [&](double lapse) {
        return best_log_likelihood(cells, lapse, kSeparationRidge);
    };
    double a = high - ratio * (high - low), b = low + ratio * (high - low);
    double value_a = value(a), value_b = value(b);
    while (high - low > 1e-4) {
        if (value_a >= value_b) {
            high = b;
            b = a;
            value_b = value_a;
            value_a = value(a = high - ratio * (high - low));
        } else {
            low = a;
            a = b;
            value_a = value_b;
            value_b = value(b = low + ratio * (high - low));
        }
    }
    LapseTest test;
    const double none = value(0.0), best = std::max(value_a, value_b);
    if (best > none) {
        test.lapse = value_a >= value_b ? a : b;
        test.likelihood_ratio = 2 * (best - none);
        test.p_value = 0.5 * (1 - chi_square_cdf(test.likelihood_ratio, 1));
    }
    return test;
}

DifferenceScale fit_scale(const QuestionCells& cells, const ScaleOptions& options) {
    DifferenceScale scale;
    scale.stimulus_count = cells.stimulus_count;
    scale.trial_count = static_cast<int>(cells.response.size());
    scale.lapse = options.lapse;
    const auto count = static_cast<std::size_t>(cells.stimulus_count);
    scale.beta.assign(count, 0.0);
    scale.se_beta.assign(count, 0.0);
    scale.psi.assign(count, 0.0);

    scale.reason = defect_of_questions(cells);
    if (!scale.reason.empty()) {
        scale.outcome = FitOutcome::NotIdentifiable;
        return scale;
    }
    if (options.estimate_lapse) scale.lapse = test_for_lapses(cells).lapse;
    Eigen::VectorXd direction;
    ProbitOptions probit{.lapse = scale.lapse};
    if (is_separated(cells.data, &direction)) {
        scale.outcome = FitOutcome::AtBound;
        scale.reason = separation_reason(direction);
        probit.ridge = kSeparationRidge;
    }
    const ProbitFit fit = fit_probit(cells.data, probit);
    scale.beta = with_leading_zero(fit.beta);
    for (std::size_t i = 1; i < count && !fit.is_singular; ++i) {
        const auto k = static_cast<Eigen::Index>(i) - 1;
        scale.se_beta[i] = std::sqrt(fit.covariance(k, k));
    }
    const double last = scale.beta.back();
    if (last != 0) {
        for (std::size_t i = 0; i < count; ++i) scale.psi[i] = scale.beta[i] / last;
        scale.sigma = 1 / last;
    }
    scale.log_likelihood = fit.log_likelihood;
    scale.deviance = -2 * fit.log_likelihood;
    const double parameters = static_cast<double>(count) - 1 + (options.estimate_lapse ? 1 : 0);
    scale.aic = scale.deviance + 2 * parameters;
    if (scale.outcome == FitOutcome::Converged && !fit.has_converged) {
        scale.outcome = FitOutcome::NotIdentifiable;
        scale.reason = "the likelihood has no clear maximum";
    }
    if (scale.outcome == FitOutcome::Converged) judge_ends(scale);
    add_warnings(scale);
    return scale;
}

DifferenceScale fit_scale(std::span<const Trial> trials, const ScaleOptions& options) {
    int count = options.stimulus_count;
    if (count == 0) count = highest_rank({trials.begin(), trials.end()});
    return fit_scale(group_trials(trials, count), options);
}

}  // namespace vitrine
