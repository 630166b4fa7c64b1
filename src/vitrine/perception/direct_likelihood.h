// perception/direct_likelihood.h: the scale by direct maximisation of the likelihood in Maloney
// and Yang's own parameters (psi_2 .. psi_{N-1}, log sigma), with psi_1 = 0 and psi_N = 1. A
// second way to the same numbers, to check the regression.
#pragma once

#include "perception/probit_glm.h"

#include <vector>

namespace vitrine {

struct DirectScale {
    std::vector<double> psi;  ///< N values, first 0, last 1
    double sigma = 0;
    double log_likelihood = 0;
    int iterations = 0;
    bool has_converged = false;
};

/// BFGS (Nocedal and Wright 2006, algorithm 6.1) with Armijo backtracking from equal steps and
/// sigma = 0.2 (R's starting point). `data.design` is that of the regression: one column for each
/// stimulus but the first. A falling scale cannot be written with psi_N = 1: it does not converge.
DirectScale fit_direct(const BinomialData& data, double lapse = 0.0);

}  // namespace vitrine
