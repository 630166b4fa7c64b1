// optics/radial_profile.h: R_d(r), diffuse reflectance per area as a function of distance.
// Any length unit; the same throughout.
#pragma once

#include "math/vector.h"

#include <array>
#include <span>
#include <vector>

namespace vitrine {

/// R_d(r) = a e^{b r} + c e^{d r} with a, c >= 0 and b, d < 0.
struct TwoExponentials {
    double a = 0.0;   ///< per area
    double b = -1.0;  ///< per length
    double c = 0.0;
    double d = -1.0;

    double operator()(double r) const;
    double total() const;               ///< 2 pi (a / b^2 + c / d^2): the albedo
    double cumulative(double r) const;  ///< albedo within r
    double mean_radius() const;         ///< of r over R_d; 0 when the total is 0
    double half_radius() const;         ///< within which half of the albedo lies
    /// The same material with all lengths times `factor`: R(r / s) / s^2, albedo unchanged.
    TwoExponentials scaled(double factor) const;
};

/// What random walks in a half-space that scatters evenly leave behind, whatever they absorb
/// (Christensen and Burley 2015, "Approximate reflectance profiles for efficient subsurface
/// scattering": R = albedo (e^{-r/l} + e^{-r/3l}) / (8 pi l r), mean radius 2.5 l), as the two
/// exponentials that are nearest beyond 0.15 mean radii: the cumulative albedo there is within 0.01.
/// Below, where no photograph resolves a profile, the exact one has a peak that these lack.
TwoExponentials random_walk_profile(double albedo, double mean_radius);

/// One set of exponentials per colour channel.
using RgbExponentials = std::array<TwoExponentials, 3>;

/// A table of R_d per channel. Between nodes it is interpolated in log R (linearly where one end
/// is 0), constant before the first node, 0 beyond the last.
struct RadialProfile {
    std::vector<double> r;  ///< increasing, >= 0
    std::vector<Rgbd> rd;   ///< per area, >= 0

    Rgbd at(double radius) const;
    /// Integral over the disc of radius `radius` (trapezium on the table, refined).
    Rgbd cumulative(double radius) const;
    /// The same within each of the rising radii, at the cost of one.
    std::vector<Rgbd> cumulative(std::span<const double> radii) const;
    Rgbd total() const;
    Rgbd mean_radius() const;
    RadialProfile scaled(double factor) const;
};

/// Nodes from `r_min` to `r_max` in geometric steps, plus r = 0.
RadialProfile tabulate(const RgbExponentials& fit, double r_min, double r_max, int count = 256);

/// Largest difference of the normalised cumulative albedo of channel `channel` over
/// r in [r_min, r_max]: the Kolmogorov-Smirnov distance of two profiles. What lies below r_min is
/// left out of both, as is what lies beyond r_max.
double profile_ks_distance(const RadialProfile& a, const RadialProfile& b, int channel,
                           double r_min, double r_max);

}  // namespace vitrine
