// estimate/ward_bound.h: the global optimum of a Ward fit with a proof, by branch and bound over
// the roughness (paper section 5.3 after Yu, Seo and Lee, CVPR 2010; bounds in docs/estimation.md).
#pragma once

#include "image/image.h"

#include <array>
#include <cstddef>
#include <vector>

namespace vitrine {

/// Weighted least squares S_xc ~ rho_d,c a_xc + rho_s,c (sum_k g_kc u exp(-t_k u) + b_xc) over
/// rho >= 0 per channel and one u = 1 / sigma^2: what a Ward fit is once each lamp is a set of
/// points. b is what does not depend on u (reflected surroundings, held).
struct WardProblem {
    std::vector<Rgbd> observed, diffuse, held;  ///< S, a, b per pixel
    std::vector<Rgbd> weight;                   ///< >= 0
    std::vector<std::size_t> first_term;        ///< of each pixel, and the end
    std::vector<double> tan2;      ///< t of each term: tan^2 of the half vector's angle
    std::vector<int> lamp;         ///< of each term, rising within a pixel
    std::vector<double> strength;  ///< g of each term per unit of the lamp's colour
    std::vector<Rgbd> lamp_colour;
    std::size_t size() const { return observed.size(); }
};

struct WardBoundOptions {
    double sigma_min = 0.01, sigma_max = 0.6;
    double relative_gap = 1e-3;  ///< between the bounds when the search ends
    int max_nodes = 4000;
    double rho_max = 20.0;  ///< of the box in which the bound holds
};

struct WardCertificate {
    double sigma = 0.0;  ///< of the best fit found
    std::array<double, 3> rho_d{}, rho_s{};
    double upper_bound = 0.0;  ///< its squared error
    double lower_bound = 0.0;  ///< no fit in the range and box has less
    int nodes = 0;             ///< intervals of sigma that were bounded
    bool is_complete = false;  ///< the gap was closed
    double relative_gap() const;
};

/// Least squared error at one roughness.
double ward_error(const WardProblem& problem, double sigma);
/// A bound from below of the error over all roughnesses in [low, high]; equal to it as they meet.
double ward_lower_bound(const WardProblem& problem, double sigma_low, double sigma_high,
                        double rho_max);

/// Best first, bisecting log sigma, with a golden-section polish of the best roughness.
/// Costs about 1 ms per node and 1000 terms.
WardCertificate certify_ward(const WardProblem& problem, const WardBoundOptions& options = {});

}  // namespace vitrine
