#include "math/optimise.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vitrine {

namespace {
constexpr double kGolden = 0.6180339887498949;
constexpr double kBoundShare = 0.01;
}  // namespace

Minimum1d minimise_golden(const std::function<double(double)>& f, double low, double high,
                          int evaluations) {
    VITRINE_CHECK_LT(low, high);
    double a = low, b = high;
    double x1 = b - kGolden * (b - a), x2 = a + kGolden * (b - a);
    double f1 = f(x1), f2 = f(x2);
    for (int i = 2; i < evaluations; ++i) {
        if (f1 <= f2) {
            b = x2;
            x2 = x1;
            f2 = f1;
            x1 = b - kGolden * (b - a);
            f1 = f(x1);
        } else {
            a = x1;
            x1 = x2;
            f1 = f2;
            x2 = a + kGolden * (b - a);
            f2 = f(x2);
        }
    }
    Minimum1d best{f1 <= f2 ? x1 : x2, std::min(f1, f2), false};
    const double margin = kBoundShare * (high - low);
    best.is_at_bound = best.x < low + margin || best.x > high - margin;
    return best;
}

Minimum1d minimise_grid_golden(const std::function<double(double)>& f, double low, double high,
                               int grid, int evaluations) {
    VITRINE_CHECK_LE(3, grid);
    const double step = (high - low) / (grid - 1);
    int best = 0;
    double best_value = 0.0;
    for (int i = 0; i < grid; ++i) {
        const double value = f(low + i * step);
        if (i == 0 || value < best_value) {
            best = i;
            best_value = value;
        }
    }
    Minimum1d minimum =
        minimise_golden(f, low + std::max(0, best - 1) * step,
                        low + std::min(grid - 1, best + 1) * step, std::max(3, evaluations));
    if (best_value < minimum.value) minimum = {low + best * step, best_value, false};
    const double margin = kBoundShare * (high - low);
    minimum.is_at_bound = minimum.x < low + margin || minimum.x > high - margin;
    return minimum;
}

MinimumNd minimise_nelder_mead(const std::function<double(const std::vector<double>&)>& f,
                               const std::vector<double>& start, const std::vector<double>& steps,
                               const NelderMeadOptions& options) {
    VITRINE_CHECK_EQ(start.size(), steps.size());
    std::vector<std::size_t> free;
    for (std::size_t i = 0; i < steps.size(); ++i)
        if (steps[i] != 0.0) free.push_back(i);
    const std::size_t n = free.size();

    struct Corner {
        std::vector<double> u;  // in units of the steps, from the start
        double value = 0.0;
    };
    MinimumNd result;
    const auto to_x = [&](const std::vector<double>& u) {
        std::vector<double> x = start;
        for (std::size_t i = 0; i < n; ++i) x[free[i]] += u[i] * steps[free[i]];
        return x;
    };
    const auto evaluate = [&](const std::vector<double>& u) {
        ++result.evaluations;
        return f(to_x(u));
    };

    std::vector<Corner> simplex;
    simplex.push_back({std::vector<double>(n, 0.0), 0.0});
    for (std::size_t i = 0; i < n; ++i) {
        simplex.push_back(simplex.front());
        simplex.back().u[i] = 1.0;
    }
    for (Corner& corner : simplex) corner.value = evaluate(corner.u);
    const auto by_value = [](const Corner& a, const Corner& b) { return a.value < b.value; };

    while (n > 0 && result.evaluations < options.max_evaluations) {
        std::stable_sort(simplex.begin(), simplex.end(), by_value);
        double size = 0.0;
        for (std::size_t i = 0; i < n; ++i)
            for (const Corner& c : simplex)
                size = std::max(size, std::abs(c.u[i] - simplex[0].u[i]));
        const double spread = simplex.back().value - simplex.front().value;
        if (size < options.min_size ||
            (spread <= options.tolerance * (std::abs(simplex.front().value) + 1e-300) &&
             size < 0.25)) {
            result.has_converged = true;
            break;
        }
        std::vector<double> centre(n, 0.0);
        for (std::size_t k = 0; k < n; ++k)
            for (std::size_t i = 0; i < n; ++i)
                centre[i] += simplex[k].u[i] / static_cast<double>(n);
        const auto along = [&](double t) {
            Corner c;
            c.u.resize(n);
            for (std::size_t i = 0; i < n; ++i)
                c.u[i] = centre[i] + t * (simplex.back().u[i] - centre[i]);
            c.value = evaluate(c.u);
            return c;
        };
        const Corner reflected = along(-1.0);
        if (reflected.value < simplex.front().value) {
            const Corner expanded = along(-2.0);
            simplex.back() = expanded.value < reflected.value ? expanded : reflected;
        } else if (reflected.value < simplex[n - 1].value) {
            simplex.back() = reflected;
        } else {
            const Corner contracted =
                reflected.value < simplex.back().value ? along(-0.5) : along(0.5);
            if (contracted.value < std::min(reflected.value, simplex.back().value)) {
                simplex.back() = contracted;
            } else {
                for (std::size_t k = 1; k < simplex.size(); ++k) {
                    for (std::size_t i = 0; i < n; ++i)
                        simplex[k].u[i] = 0.5 * (simplex[k].u[i] + simplex[0].u[i]);
                    simplex[k].value = evaluate(simplex[k].u);
                }
            }
        }
    }
    std::stable_sort(simplex.begin(), simplex.end(), by_value);
    result.x = to_x(simplex.front().u);
    result.value = simplex.front().value;
    return result;
}

}  // namespace vitrine
