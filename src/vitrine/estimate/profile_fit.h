// estimate/profile_fit.h: radial profiles fitted to observed exitance through a distance histogram.
#pragma once

#include "estimate/distance_histogram.h"
#include "optics/radial_profile.h"

#include <vector>

namespace vitrine {

struct ProfileFitOptions {
    double shortest_px = 1;  ///< bounds of the lengths 1/|b|, 1/|d|
    double longest_px = 100;
    double extent_px = 300;  ///< outer edge of the last shell
    int shell_count = 24;
    double ridge = 1e-4;
    int length_count = 40;  ///< grid of lengths, geometric
    /// Two free exponentials take up errors: a narrow one edges that are too sharp, a wide one
    /// light that the list lacks. Where shape and light are trusted, the profile of random walks
    /// (optics/radial_profile) stands unless free ones leave less than 0.35 of its misfit.
    bool prefers_random_walk = false;
};

/// Edges of the steps: 0, 1.5 cells, then geometric.
struct ShellGrid {
    std::vector<double> edge;
};
ShellGrid make_shells(double step_px, double extent_px, int count);

struct PiecewiseProfile {
    Eigen::VectorXd value;  ///< R_d per shell
    bool is_converged = true;
};

/// R = T v with v >= 0 and T summing from the outside in: non-negative and falling.
PiecewiseProfile fit_piecewise_monotone(const DistanceHistogram& histogram,
                                        const Eigen::VectorXd& exitance, int field,
                                        const ProfileFitOptions& options);

/// As published: QMR on the ridged normal equations, negative steps cut to 0.
PiecewiseProfile fit_piecewise_qmr(const DistanceHistogram& histogram,
                                   const Eigen::VectorXd& exitance, int field,
                                   const ProfileFitOptions& options);

/// e^{-r / length}
RadialKernel plain_exponential(double length);

/// `count` lengths from the shortest to the longest, each the same factor longer.
std::vector<double> length_grid(double shortest, double longest, int count);

/// Huber's weights of squares: 1 up to 1.5 robust standard deviations (at least `least_sd`),
/// falling as 1 / |residual| beyond.
Eigen::VectorXd huber_factors(const Eigen::VectorXd& residual, double least_sd);

/// The pair of lengths, with amplitudes >= 0, that best explains y: amplitudes follow in closed
/// form from inner products (variable projection), every pair is tried.
/// @param images one column per length: the picture of e^{-r / length}; @param weight of squares
TwoExponentials best_pair(const Eigen::MatrixXd& images, const Eigen::VectorXd& y,
                          const Eigen::VectorXd& weight, const std::vector<double>& lengths);

/// Two exponentials that best explain the exitance: for every pair of lengths on a grid the
/// amplitudes follow in closed form (variable projection); robust weights (Huber, 4 rounds).
TwoExponentials fit_exponentials(const DistanceHistogram& histogram,
                                 const Eigen::VectorXd& exitance, int field,
                                 const ProfileFitOptions& options);

/// Two exponentials through the steps, weighted with shell area (the published way).
TwoExponentials fit_exponentials_to_shells(const ShellGrid& shells, const Eigen::VectorXd& value,
                                           const ProfileFitOptions& options);

/// Fits the brightest channel freely; the others are that profile with their own albedo and a
/// width at most as large, ordered like the albedos: R_c(r) = rho_c R(r / s_c) / s_c^2. A channel
/// that a profile of its own explains far better (milk scatters blue light more than red) keeps
/// that.
/// @param exitance one column per channel; field c of the histogram belongs to channel c
RgbExponentials fit_ordered(const DistanceHistogram& histogram, const Eigen::MatrixXd& exitance,
                            const ProfileFitOptions& options);

}  // namespace vitrine
