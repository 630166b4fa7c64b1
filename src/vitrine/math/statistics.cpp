#include "math/statistics.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vitrine {
namespace {

/// Regularised lower incomplete gamma P(a, x): series below a + 1, Lentz continued fraction above.
double gamma_p(double a, double x) {
    if (x <= 0) return 0.0;
    const double front = std::exp(-x + a * std::log(x) - std::lgamma(a));
    if (x < a + 1) {
        double term = 1.0 / a, sum = term;
        for (int n = 1; n < 10000; ++n) {
            term *= x / (a + n);
            sum += term;
            if (term < sum * 1e-16) break;
        }
        return front * sum;
    }
    constexpr double kTiny = 1e-300;
    double b = x + 1 - a, c = 1 / kTiny, d = 1 / b, h = d;
    for (int i = 1; i < 10000; ++i) {
        const double an = -i * (i - a);
        b += 2;
        d = an * d + b;
        if (std::abs(d) < kTiny) d = kTiny;
        c = b + an / c;
        if (std::abs(c) < kTiny) c = kTiny;
        d = 1 / d;
        const double delta = d * c;
        h *= delta;
        if (std::abs(delta - 1) < 1e-15) break;
    }
    return 1 - front * h;
}

}  // namespace

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

double normal_pdf(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2.0 * M_PI); }

double normal_quantile(double p) {
    if (p <= 0) return -INFINITY;
    if (p >= 1) return INFINITY;
    static const double a[] = {-3.969683028665376e+01, 2.209460984245205e+02,
                               -2.759285104469687e+02, 1.383577518672690e+02,
                               -3.066479806614716e+01, 2.506628277459239e+00};
    static const double b[] = {-5.447609879822406e+01, 1.615858368580409e+02,
                               -1.556989798598866e+02, 6.680131188771972e+01,
                               -1.328068155288572e+01};
    static const double c[] = {-7.784894002430293e-03, -3.223964580411365e-01,
                               -2.400758277161838e+00, -2.549732539343734e+00,
                               4.374664141464968e+00,  2.938163982698783e+00};
    static const double d[] = {7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00,
                               3.754408661907416e+00};
    const auto tail = [&](double q) {
        return (((((c[0] * q + c[1]) * q + c[2]) * q + c[3]) * q + c[4]) * q + c[5]) /
               ((((d[0] * q + d[1]) * q + d[2]) * q + d[3]) * q + 1);
    };
    double z;
    if (p < 0.02425) {
        z = tail(std::sqrt(-2 * std::log(p)));
    } else if (p > 1 - 0.02425) {
        z = -tail(std::sqrt(-2 * std::log1p(-p)));
    } else {
        const double q = p - 0.5, r = q * q;
        z = (((((a[0] * r + a[1]) * r + a[2]) * r + a[3]) * r + a[4]) * r + a[5]) * q /
            (((((b[0] * r + b[1]) * r + b[2]) * r + b[3]) * r + b[4]) * r + 1);
    }
    const double error = normal_cdf(z) - p;
    const double u = error * std::sqrt(2 * M_PI) * std::exp(0.5 * z * z);
    return z - u / (1 + 0.5 * z * u);
}

double chi_square_cdf(double x, double degrees_of_freedom) {
    return gamma_p(0.5 * degrees_of_freedom, 0.5 * x);
}

ChiSquareResult chi_square_test(std::span<const double> observed,
                                std::span<const double> expected) {
    VITRINE_CHECK_EQ(observed.size(), expected.size());
    std::vector<std::size_t> order(observed.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t i, std::size_t j) { return expected[i] < expected[j]; });
    ChiSquareResult result;
    double pooled_observed = 0, pooled_expected = 0;
    int cells = 0;
    const auto add = [&](double o, double e) {
        result.statistic += (o - e) * (o - e) / e;
        ++cells;
    };
    for (const std::size_t i : order) {
        if (expected[i] <= 0) {
            if (observed[i] > 0) {
                result.p_value = 0;
                result.description = fmt::format("{} samples where none can be", observed[i]);
                return result;
            }
        } else if (expected[i] < 5 || (pooled_expected > 0 && pooled_expected < 5)) {
            pooled_observed += observed[i];
            pooled_expected += expected[i];
        } else {
            add(observed[i], expected[i]);
        }
    }
    if (pooled_expected > 0) add(pooled_observed, pooled_expected);
    result.degrees_of_freedom = std::max(1, cells - 1);
    result.p_value = 1 - chi_square_cdf(result.statistic, result.degrees_of_freedom);
    result.description = fmt::format("chi2 = {:.2f}, {} degrees of freedom, p = {:.4g}",
                                     result.statistic, result.degrees_of_freedom, result.p_value);
    return result;
}

double sidak(double alpha, double count) { return -std::expm1(std::log1p(-alpha) / count); }

double mean(std::span<const double> values) {
    return values.empty() ? 0.0
                          : std::accumulate(values.begin(), values.end(), 0.0) /
                                static_cast<double>(values.size());
}

double standard_deviation(std::span<const double> values) {
    if (values.size() < 2) return 0.0;
    const double m = mean(values);
    double sum = 0;
    for (const double v : values) sum += (v - m) * (v - m);
    return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

double quantile(std::vector<double> values, double q) {
    VITRINE_CHECK(!values.empty());
    std::sort(values.begin(), values.end());
    const double position = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    const double t = position - static_cast<double>(below);
    return values[below] * (1 - t) + values[above] * t;
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double robust_sd(std::vector<double> values) {
    const double centre = median(values);
    for (double& v : values) v = std::abs(v - centre);
    return 1.4826 * median(std::move(values));
}

double weighted_median(std::span<const double> values, std::span<const double> weights) {
    VITRINE_CHECK_EQ(values.size(), weights.size());
    VITRINE_CHECK(!values.empty());
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t i, std::size_t j) { return values[i] < values[j]; });
    const double half = 0.5 * std::accumulate(weights.begin(), weights.end(), 0.0);
    double running = 0;
    for (const std::size_t i : order) {
        running += weights[i];
        if (running >= half) return values[i];
    }
    return values[order.back()];
}

}  // namespace vitrine
