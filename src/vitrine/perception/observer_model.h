// perception/observer_model.h: how an observer answers, as a probability; and made-up observers of
// known scale, noise and lapses, for planning a study and for testing its analysis.
//
// The observer compares the two differences with Gaussian noise (Maloney and Yang 2003):
//     Delta = (psi_S4 - psi_S3) - (psi_S2 - psi_S1) + sigma eps,   answers 1 when Delta > 0.
// With beta = psi / sigma:  P(1) = lapse / 2 + (1 - lapse) Phi(eta),  eta = Delta's mean / sigma.
#pragma once

#include "perception/trial.h"

#include <cstdint>
#include <span>
#include <vector>

namespace vitrine {

/// Everything the likelihood needs at one eta. p + q = 1 without cancellation in either tail.
struct AnswerProbability {
    double log_p = 0, log_q = 0;      ///< of answering 1 and 0
    double score_p = 0, score_q = 0;  ///< d log_p / d eta >= 0 and -d log_q / d eta >= 0
    /// Fisher information of one answer about eta.
    double information() const { return score_p * score_q; }
};

/// @param lapse share of trials answered by a coin, in [0, 1)
AnswerProbability answer_probability(double eta, double lapse = 0.0);

/// P(answer 1) alone.
double probability_of_one(double eta, double lapse = 0.0);

struct SimulatedObserver {
    std::vector<double> beta;  ///< scale in units of the decision noise, one per stimulus
    double lapse = 0.0;
};

/// eta of a question under a scale.
double decision_variable(std::span<const double> beta, const Quadruple& rank);

/// Answers `questions` in order. The same seed gives the same answers.
std::vector<Trial> simulate_answers(const SimulatedObserver& observer,
                                    std::span<const Quadruple> questions, std::uint64_t seed);

/// The scale of an observer whose smallest visible step is `lambda` at the steepest place:
/// straight for `power` 1, else proportional to (n - n_1)^power. d' = 1 over a change of 0.5 in
/// beta (threshold.h).
std::vector<double> scale_with_threshold(std::span<const double> stimuli, double lambda,
                                         double power = 1.0);

}  // namespace vitrine
