// perception/study.h: the whole analysis of a study: each observer alone, all pooled, their mean.
#pragma once

#include "perception/scale_bootstrap.h"
#include "perception/scale_diagnostics.h"

#include <array>
#include <string>
#include <vector>

namespace vitrine {

/// One observer (or all pooled): the scale, lambda, how far to trust them, and whether the model
/// holds. Plain values: this is what scale.json stores.
struct ScaleAnalysis {
    std::string name;
    DifferenceScale scale;
    std::vector<Interval> psi_ci95, beta_ci95;
    Interval sigma_ci95;
    /// The same scale by direct maximisation; agrees to rounding where the scale is usable.
    double direct_log_likelihood = 0;
    double direct_psi_difference = 0;  ///< largest |psi - psi_direct|
    Threshold lambda;
    Interval lambda_ci95;
    std::vector<Interval> local_ci95;
    int smooth_degrees_of_freedom = 0;  ///< 1: the scale is straight as far as the data say
    std::vector<std::array<double, 2>> smooth_curve;  ///< (n, beta), for plots
    int bootstrap_replicates = 0;
    int separated_replicates = 0;
    ScaleDiagnostics diagnostics;
    int catch_count = 0, catch_failed = 0;  ///< catch trials asked and missed
};

/// Do the observers share one scale? Likelihood ratio of separate scales against the pooled one.
struct HeterogeneityTest {
    double likelihood_ratio = 0;
    int degrees_of_freedom = 0;
    double p_value = 1;
};

struct StudyAnalysis {
    std::vector<double> stimuli;   ///< refractive indices, or ranks when no list was given
    bool stimuli_are_ior = false;  ///< else lambda is in ranks and no estimator may use it
    ScaleAnalysis pooled;
    std::vector<ScaleAnalysis> observers;  ///< empty when there is one
    std::vector<double> mean_psi;          ///< over the usable observers (the paper's Fig. 7)
    double lambda_geometric_mean = kNoThreshold;
    double lambda_log_sd = 0;  ///< spread between observers, of ln lambda
    HeterogeneityTest heterogeneity;
};

struct StudyOptions {
    BootstrapOptions bootstrap;
    int observer_replicates = 2'000;  ///< per single observer, when there are several
    int diagnostic_simulations = 1'000;
    bool estimate_lapse = false;
    double lapse = 0.0;
    bool is_reversed = false;  ///< turn every answer: the more alike pair was asked for
};

/// @param stimuli rising refractive indices, one per rank; empty: ranks are used
/// @throws InputError when ranks exceed the stimuli or the stimuli do not rise.
StudyAnalysis analyse_study(const std::vector<Observations>& observations,
                            const std::vector<double>& stimuli, const StudyOptions& options = {},
                            const Progress& progress = {});

}  // namespace vitrine
