// perception/scale_diagnostics.h: does the difference model hold for these answers?
#pragma once

#include "base/progress.h"
#include "perception/difference_scale.h"

#include <cstdint>
#include <span>
#include <vector>

namespace vitrine {

/// The six-point test (Maloney and Yang 2003; Knoblauch and Maloney 2008, sec. 4.2): for
/// a < b < c < a' < b' < c', (a,b) > (a',b') and (b,c) > (b',c') ask for (a,c) > (a',c'). The
/// log-likelihood of the answers to all such triples is compared with that of answers drawn from
/// the fitted scale and refitted.
struct SixPointTest {
    int conditions = 0;  ///< triples found; 0: not testable, p_value = 1
    int violations = 0;  ///< triples whose answers break the rule outright
    double log_likelihood = 0;
    double p_value = 1;  ///< share of simulations at most as likely; small: the model fails
    int simulations = 0;
};

/// Deviance residuals (Wood 2006; R's `binom.diagnostics`): their distribution within a simulated
/// envelope, and the number of sign changes along the fitted values.
struct ResidualDiagnostics {
    std::vector<double> sorted;     ///< observed deviance residuals
    std::vector<double> low, high;  ///< 95 % envelope of each order statistic
    double share_inside = 0;
    int runs = 0;             ///< sign changes in order of the fitted probabilities
    double runs_p_value = 1;  ///< share of simulations with at most as many; small: lack of fit
    int simulations = 0;
};

struct ScaleDiagnostics {
    SixPointTest six_point;
    ResidualDiagnostics residuals;
    LapseTest lapses;
};

struct DiagnosticsOptions {
    int simulations = 1000;
    std::uint64_t seed = 0;
};

/// @param sessions index of the session (observer) of each trial: triples are formed within one
/// Cost: one refit per simulation, shared by both tests.
ScaleDiagnostics diagnose_scale(const QuestionCells& cells, const DifferenceScale& scale,
                                std::span<const int> sessions,
                                const DiagnosticsOptions& options = {},
                                const Progress& progress = {});

/// The triples of trial indices that make six-point conditions; a question asked k times in a
/// session makes its k-th answers meet.
std::vector<std::array<int, 3>> six_point_conditions(const QuestionCells& cells,
                                                     std::span<const int> sessions);

}  // namespace vitrine
