// math/statistics.h: distribution functions and tests, for the statistical tests of samplers and
// renders, for difference scaling and for robust fits.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace vitrine {

double normal_cdf(double z);
double normal_pdf(double z);
/// Inverse normal distribution (Acklam's rational start, one Halley step): |error| < 1e-13.
double normal_quantile(double p);
/// P(X <= x) of the chi-square distribution (regularised lower incomplete gamma).
double chi_square_cdf(double x, double degrees_of_freedom);

struct ChiSquareResult {
    double statistic = 0.0;
    int degrees_of_freedom = 0;
    double p_value = 1.0;
    std::string description;
};
/// Pearson's test; cells with expected count below 5 are pooled. A count where none is expected
/// gives p = 0.
ChiSquareResult chi_square_test(std::span<const double> observed, std::span<const double> expected);

/// Corrects a significance level for `count` tests at once (Sidak 1967).
double sidak(double alpha, double count);

double mean(std::span<const double> values);
double standard_deviation(std::span<const double> values);  ///< with n - 1
double median(std::vector<double> values);
double quantile(std::vector<double> values, double q);  ///< linear between order statistics
/// 1.4826 times the median absolute deviation.
double robust_sd(std::vector<double> values);
/// First value whose cumulative weight reaches half of the total.
double weighted_median(std::span<const double> values, std::span<const double> weights);

}  // namespace vitrine
