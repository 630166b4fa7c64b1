// math/optimise.h: small derivative-free minimisers, for objectives with kinks and jumps (shadow
// borders, robust losses) that defeat Gauss-Newton. Deterministic: same calls, same bits.
#pragma once

#include <functional>
#include <vector>

namespace vitrine {

struct Minimum1d {
    double x = 0.0;
    double value = 0.0;
    bool is_at_bound = false;  ///< within 1 % of the interval of one of its ends
};

/// Golden-section search on [low, high]; exact for one minimum. `evaluations` calls.
Minimum1d minimise_golden(const std::function<double(double)>& f, double low, double high,
                          int evaluations = 24);

/// Grid of `grid` equally spaced values on [low, high], then golden section between the
/// neighbours of the best: finds the global minimum when no basin is narrower than a cell.
Minimum1d minimise_grid_golden(const std::function<double(double)>& f, double low, double high,
                               int grid, int evaluations = 20);

struct NelderMeadOptions {
    int max_evaluations = 200;
    double tolerance = 1e-4;  ///< stops when the simplex' values differ relatively by less
    double min_size = 1e-4;   ///< and its extent (in units of the initial steps) is below this
};
struct MinimumNd {
    std::vector<double> x;
    double value = 0.0;
    int evaluations = 0;
    bool has_converged = false;
};
/// Downhill simplex (Nelder and Mead 1965, coefficients 1, 2, 1/2, 1/2) from `start`, with the
/// first simplex spanned by `steps`. A parameter with step 0 stays fixed.
MinimumNd minimise_nelder_mead(const std::function<double(const std::vector<double>&)>& f,
                               const std::vector<double>& start, const std::vector<double>& steps,
                               const NelderMeadOptions& options = {});

}  // namespace vitrine
