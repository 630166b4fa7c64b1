// perception/difference_scale.h: the perceptual scale of one observer, or of several pooled.
//
// Regression form of Maloney and Yang's model (Knoblauch and Maloney 2008): each question is a row
// with +1 at S4 and S1, -1 at S3 and S2; the first stimulus has no column (beta_1 = 0); probit
// link; beta = psi / sigma. Standard scale: psi_1 = 0, psi_N = 1, sigma = 1 / beta_N.
#pragma once

#include "perception/probit_glm.h"
#include "perception/trial.h"

#include <span>
#include <string>
#include <vector>

namespace vitrine {

/// Answers grouped by question: equal questions are one row.
struct QuestionCells {
    std::vector<Quadruple> rank;  ///< canonical, in order of first appearance
    BinomialData data;            ///< design with N - 1 columns
    std::vector<int> cell_of_trial;
    std::vector<int> response;  ///< canonical, per trial
    int stimulus_count = 0;
};
QuestionCells group_trials(std::span<const Trial> trials, int stimulus_count);

enum class FitOutcome {
    Converged,
    AtBound,          ///< separated answers: no finite maximum; a mild ridge holds the numbers
    NotIdentifiable,  ///< missing cells, too few trials, reversed answers, no visible difference
};
/// The words of estimate.json: "converged", "at_bound", "not_identifiable".
std::string outcome_name(FitOutcome outcome);

struct ScaleOptions {
    int stimulus_count = 0;       ///< 0: the highest rank that occurs
    double lapse = 0.0;           ///< known share of random answers
    bool estimate_lapse = false;  ///< fit that share too
};

struct DifferenceScale {
    int stimulus_count = 0;
    int trial_count = 0;
    std::vector<double> beta;     ///< unnormalised (noise = 1), N values, first 0
    std::vector<double> se_beta;  ///< from the expected information
    std::vector<double> psi;      ///< standard: first 0, last 1
    double sigma = 0;             ///< 1 / beta_N
    double lapse = 0;
    double log_likelihood = 0;  ///< of the single answers
    double aic = 0;
    double deviance = 0;  ///< -2 log-likelihood: the saturated model of single answers has 0
    FitOutcome outcome = FitOutcome::Converged;
    std::string reason;                 ///< in words, when the outcome is not Converged
    std::vector<std::string> warnings;  ///< weaker doubts
    bool is_usable() const { return outcome == FitOutcome::Converged; }
};

/// Fits the scale. Weak data is an answer, not an error: see `outcome`.
DifferenceScale fit_scale(const QuestionCells& cells, const ScaleOptions& options = {});
DifferenceScale fit_scale(std::span<const Trial> trials, const ScaleOptions& options = {});

/// Maximum likelihood share of random answers, with the likelihood ratio test against none. The
/// null value is on the border of the parameter, so the statistic is an even mixture of chi-square
/// with 0 and 1 degrees of freedom (Self and Liang 1987).
struct LapseTest {
    double lapse = 0;
    double likelihood_ratio = 0;
    double p_value = 1;
};
LapseTest test_for_lapses(const QuestionCells& cells);

/// beta with its leading zero from the N - 1 regression coefficients.
std::vector<double> with_leading_zero(const Eigen::VectorXd& coefficients);

}  // namespace vitrine
