// perception/scale_bootstrap.h: how far the scale and lambda can be trusted.
//
// Parametric bootstrap (answers drawn anew from the fitted probabilities, everything refitted)
// with bias-corrected and accelerated limits (BCa; Efron 1987). Plain percentile limits of this
// model cover less than they say (Aguilar, Wichmann and Maertens 2017).
#pragma once

#include "base/progress.h"
#include "perception/difference_scale.h"
#include "perception/threshold.h"

#include <cstdint>
#include <span>
#include <vector>

namespace vitrine {

struct Interval {
    double low = 0, high = 0;
};

/// BCa limits of an estimate from its replicates.
/// @param acceleration sixth of the skewness of the estimate's score (see `acceleration_of`)
Interval bca_interval(double estimate, std::vector<double> replicates, double acceleration,
                      double level);

/// Efron 1987, eq. 6.7 for independent answers with known probabilities: a = skewness / 6 of the
/// score in the direction in which `gradient` (of the quantity by the coefficients) changes most.
double acceleration_of(const BinomialData& data, const Eigen::VectorXd& coefficients,
                       const Eigen::VectorXd& gradient, double lapse);

struct BootstrapOptions {
    int replicates = 10'000;  ///< the tails of BCa want thousands
    double level = 0.95;
    std::uint64_t seed = 0;  ///< one seed, one answer, on any number of threads
    bool want_scale = true;  ///< psi, beta and sigma; off: lambda alone
};

struct ScaleBootstrap {
    int replicates = 0;
    std::vector<Interval> psi, beta;  ///< per stimulus; degenerate where fixed by definition
    Interval sigma;
    Interval lambda;
    std::vector<Interval> local_lambda;  ///< per stimulus
    int separated_replicates = 0;        ///< held by a ridge, as the fit itself would be
};

/// Scale replicates are drawn from the full scale, lambda's from the smooth scale that gave lambda,
/// and the choice of its degrees of freedom is repeated in every replicate.
/// Cost: 0.6 ms per replicate and core for 210 trials of ten stimuli.
ScaleBootstrap bootstrap_scale(const QuestionCells& cells, const DifferenceScale& scale,
                               const SmoothFitter& fitter, const SmoothScale& smooth,
                               std::span<const double> stimuli,
                               const BootstrapOptions& options = {}, const Progress& progress = {});

}  // namespace vitrine
