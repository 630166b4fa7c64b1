#include "estimate/profile_fit.h"

#include "base/parallel.h"
#include "math/nnls.h"
#include "math/qmr.h"
#include "math/statistics.h"

#include <array>

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// One column per shell: the image of a unit step there.
MatrixXd shell_images(const DistanceHistogram& histogram, const ShellGrid& shells, int field) {
    const std::size_t count = shells.edge.size() - 1;
    MatrixXd images;
    for (std::size_t k = 0; k < count; ++k) {
        VectorXd value(static_cast<Index>(histogram.nodes().size()));
        for (std::size_t n = 0; n < histogram.nodes().size(); ++n) {
            const double r = histogram.nodes()[n];
            value[static_cast<Index>(n)] = r >= shells.edge[k] && r < shells.edge[k + 1] ? 1 : 0;
        }
        const VectorXd column = histogram.image_of_nodes(value).col(field);
        if (k == 0) images.resize(column.size(), static_cast<Index>(count));
        images.col(static_cast<Index>(k)) = column;
    }
    return images;
}

/// Misfit weights: relative with a floor, so that dark pixels do not pull the mean.
VectorXd base_weights(const VectorXd& y) {
    const double floor = std::max(0.7 * y.mean(), 1e-12);
    return y.cwiseMax(floor).cwiseInverse().cwiseAbs2();
}

/// Huber's weights on top, from the residuals of the last round.
VectorXd huber_weights(const VectorXd& residual, const VectorXd& base) {
    const VectorXd scaled = residual.cwiseProduct(base.cwiseSqrt());
    return base.cwiseProduct(huber_factors(scaled, 1e-9));
}

/// A free profile that leaves less than this share of what an ordered one does refutes the order.
constexpr double kRefuted = 0.7;

/// The same for the shape of random walks.
constexpr double kWalkRefuted = 0.35;

struct PairFit {
    double a = 0, c = 0, cost = 1e300;
};
/// min |y - a u - c v|^2 over a, c >= 0 from inner products.
PairFit solve_pair(double uu, double uv, double vv, double uy, double vy, double yy) {
    const double determinant = uu * vv - uv * uv;
    PairFit best;
    const auto consider = [&](double a, double c) {
        const double cost = yy - 2 * (a * uy + c * vy) + a * a * uu + 2 * a * c * uv + c * c * vv;
        if (cost < best.cost) best = {a, c, cost};
    };
    consider(std::max(0.0, uy / std::max(uu, 1e-300)), 0);
    consider(0, std::max(0.0, vy / std::max(vv, 1e-300)));
    if (determinant > 1e-10 * uu * vv) {
        const double a = (uy * vv - vy * uv) / determinant;
        const double c = (vy * uu - uy * uv) / determinant;
        if (a > 0 && c > 0) consider(a, c);
    }
    return best;
}

}  // namespace

RadialKernel plain_exponential(double length) {
    return [length](double r) { return std::exp(-r / length); };
}

std::vector<double> length_grid(double shortest, double longest, int count) {
    std::vector<double> lengths;
    for (int i = 0; i < count; ++i) {
        lengths.push_back(shortest *
                          std::pow(longest / shortest, static_cast<double>(i) / (count - 1)));
    }
    return lengths;
}

VectorXd huber_factors(const VectorXd& residual, double least_sd) {
    const std::vector<double> values(residual.data(), residual.data() + residual.size());
    const double bend = 1.5 * std::max(robust_sd(values), least_sd);
    VectorXd factors = VectorXd::Ones(residual.size());
    for (Index i = 0; i < residual.size(); ++i) {
        const double size = std::abs(residual[i]);
        if (size > bend) factors[i] = bend / size;
    }
    return factors;
}

TwoExponentials best_pair(const MatrixXd& images, const VectorXd& y, const VectorXd& weight,
                          const std::vector<double>& lengths) {
    const MatrixXd weighted = weight.asDiagonal() * images;
    const MatrixXd gram = images.transpose() * weighted;
    const VectorXd h = weighted.transpose() * y;
    const double yy = y.dot(weight.cwiseProduct(y));
    TwoExponentials best;
    double cost = 1e300;
    for (Index i = 0; i < gram.rows(); ++i) {
        for (Index j = i + 1; j < gram.rows(); ++j) {
            const PairFit pair = solve_pair(gram(i, i), gram(i, j), gram(j, j), h[i], h[j], yy);
            if (pair.cost < cost * (1 - 1e-9)) {
                cost = pair.cost;
                best = {pair.a, -1 / lengths[static_cast<std::size_t>(i)], pair.c,
                        -1 / lengths[static_cast<std::size_t>(j)]};
            }
        }
    }
    return best;
}

ShellGrid make_shells(double step_px, double extent_px, int count) {
    ShellGrid shells;
    shells.edge.push_back(0);
    const double first = 1.5 * step_px, last = std::max(extent_px, 3 * first);
    for (int k = 0; k < count; ++k)
        shells.edge.push_back(first * std::pow(last / first, static_cast<double>(k) / (count - 1)));
    return shells;
}

PiecewiseProfile fit_piecewise_monotone(const DistanceHistogram& histogram,
                                        const VectorXd& exitance, int field,
                                        const ProfileFitOptions& options) {
    const ShellGrid shells =
        make_shells(histogram.step_px(), options.extent_px, options.shell_count);
    const MatrixXd images = shell_images(histogram, shells, field);
    const Index count = images.cols();
    MatrixXd cumulative(images.rows(), count);
    VectorXd sum = VectorXd::Zero(images.rows());
    for (Index k = 0; k < count; ++k) {
        sum += images.col(k);
        cumulative.col(k) = sum;
    }
    const VectorXd weight = base_weights(exitance).cwiseSqrt();
    MatrixXd a = weight.asDiagonal() * cumulative;
    const VectorXd scale = a.colwise().norm().transpose().cwiseMax(1e-12);
    for (Index k = 0; k < count; ++k) a.col(k) /= scale[k];
    MatrixXd gram = a.transpose() * a;
    gram.diagonal().array() += options.ridge;
    const NnlsResult solution =
        solve_nnls_gram(gram, a.transpose() * weight.cwiseProduct(exitance));
    PiecewiseProfile profile;
    profile.value = VectorXd::Zero(count);
    profile.is_converged = solution.is_converged;
    double tail = 0;
    for (Index k = count - 1; k >= 0; --k) {
        tail += solution.x[k] / scale[k];
        profile.value[k] = tail;
    }
    return profile;
}

PiecewiseProfile fit_piecewise_qmr(const DistanceHistogram& histogram, const VectorXd& exitance,
                                   int field, const ProfileFitOptions& options) {
    const ShellGrid shells =
        make_shells(histogram.step_px(), options.extent_px, options.shell_count);
    MatrixXd a = shell_images(histogram, shells, field);
    const VectorXd scale = a.colwise().norm().transpose().cwiseMax(1e-12);
    for (Index k = 0; k < a.cols(); ++k) a.col(k) /= scale[k];
    MatrixXd gram = a.transpose() * a;
    gram.diagonal().array() += options.ridge;
    const QmrResult solution = solve_qmr(gram, a.transpose() * exitance, {.tolerance = 1e-9});
    PiecewiseProfile profile;
    profile.value = solution.x.cwiseQuotient(scale).cwiseMax(0.0);
    profile.is_converged = solution.is_converged;
    return profile;
}

TwoExponentials fit_exponentials(const DistanceHistogram& histogram, const VectorXd& exitance,
                                 int field, const ProfileFitOptions& options) {
    const std::vector<double> lengths =
        length_grid(options.shortest_px, options.longest_px, options.length_count);
    MatrixXd images(exitance.size(), static_cast<Index>(lengths.size()));
    for (std::size_t i = 0; i < lengths.size(); ++i)
        images.col(static_cast<Index>(i)) =
            histogram.image_of(plain_exponential(lengths[i])).col(field);
    const VectorXd base = base_weights(exitance);
    VectorXd weight = base;
    TwoExponentials fit;
    for (int round = 0; round < 4; ++round) {
        fit = best_pair(images, exitance, weight, lengths);
        weight = huber_weights(histogram.image_of(fit).col(field) - exitance, base);
    }
    return fit;
}

TwoExponentials fit_exponentials_to_shells(const ShellGrid& shells, const VectorXd& value,
                                           const ProfileFitOptions& options) {
    const std::vector<double> lengths =
        length_grid(options.shortest_px, options.longest_px, options.length_count);
    MatrixXd columns(value.size(), static_cast<Index>(lengths.size()));
    VectorXd area(value.size());
    for (Index k = 0; k < value.size(); ++k) {
        const double r0 = shells.edge[static_cast<std::size_t>(k)];
        const double r1 = shells.edge[static_cast<std::size_t>(k) + 1];
        area[k] = kPi * (r1 * r1 - r0 * r0);
        for (std::size_t i = 0; i < lengths.size(); ++i) {
            const TwoExponentials unit{1, -1 / lengths[i], 0, -1};
            columns(k, static_cast<Index>(i)) =
                (unit.cumulative(r1) - unit.cumulative(r0)) / area[k];
        }
    }
    return best_pair(columns, value, area, lengths);
}

namespace {

/// The factor of an image that best explains y, robust, and what it leaves unexplained.
struct Level {
    double factor = 0, cost = 0;
};
Level fit_level(const VectorXd& image, const VectorXd& y) {
    const VectorXd plain = base_weights(y);
    VectorXd weight = plain;
    Level level;
    for (int round = 0; round < 3; ++round) {
        const VectorXd weighted = weight.cwiseProduct(image);
        level.factor = std::max(0.0, weighted.dot(y) / std::max(weighted.dot(image), 1e-300));
        weight = huber_weights(level.factor * image - y, plain);
    }
    level.cost = (level.factor * image - y).cwiseAbs2().dot(weight);
    return level;
}

double misfit(const DistanceHistogram& histogram, const VectorXd& y, int field,
              const TwoExponentials& fit) {
    return (histogram.image_of(fit).col(field) - y).cwiseAbs2().dot(base_weights(y));
}

/// The profile of random walks whose width explains the picture best.
TwoExponentials fit_random_walk(const DistanceHistogram& histogram, const VectorXd& exitance,
                                int field, const ProfileFitOptions& options) {
    TwoExponentials best;
    double lowest = 1e300;
    for (const double width :
         length_grid(2 * options.shortest_px, 2 * options.longest_px, options.length_count)) {
        const TwoExponentials unit = random_walk_profile(1, width);
        const Level level = fit_level(histogram.image_of(unit).col(field), exitance);
        if (level.cost >= lowest) continue;
        lowest = level.cost;
        best = random_walk_profile(level.factor, width);
    }
    return best;
}

TwoExponentials fit_one(const DistanceHistogram& histogram, const VectorXd& exitance, int field,
                        const ProfileFitOptions& options) {
    const TwoExponentials free = fit_exponentials(histogram, exitance, field, options);
    if (!options.prefers_random_walk) return free;
    const TwoExponentials walk = fit_random_walk(histogram, exitance, field, options);
    const bool is_refuted = misfit(histogram, exitance, field, free) <
                            kWalkRefuted * misfit(histogram, exitance, field, walk);
    return is_refuted ? free : walk;
}

}  // namespace

RgbExponentials fit_ordered(const DistanceHistogram& histogram, const MatrixXd& exitance,
                            const ProfileFitOptions& options) {
    int reference = 0;
    for (int c = 1; c < 3; ++c)
        if (exitance.col(c).mean() > exitance.col(reference).mean()) reference = c;
    const TwoExponentials base = fit_one(histogram, exitance.col(reference), reference, options);
    RgbExponentials result;
    result[static_cast<std::size_t>(reference)] = base;

    // Per other channel and width: the best level and what it leaves unexplained.
    constexpr int kWidths = 25;
    constexpr double kNarrowest = 0.25;
    std::array<std::array<Level, kWidths>, 3> trials;
    std::array<double, kWidths> width{};
    for (int i = 0; i < kWidths; ++i) {
        width[static_cast<std::size_t>(i)] =
            std::pow(kNarrowest, 1 - static_cast<double>(i) / (kWidths - 1));
        const MatrixXd image = histogram.image_of(base.scaled(width[static_cast<std::size_t>(i)]));
        for (int c = 0; c < 3; ++c) {
            if (c == reference) continue;
            Level trial = fit_level(image.col(c), exitance.col(c));
            const double log_width = std::log(width[static_cast<std::size_t>(i)]);
            trial.cost *= 1 + 0.03 * log_width * log_width;
            trials[static_cast<std::size_t>(c)][static_cast<std::size_t>(i)] = trial;
        }
    }
    const int first = reference == 0 ? 1 : 0, second = reference == 2 ? 1 : 2;
    const auto& one = trials[static_cast<std::size_t>(first)];
    const auto& two = trials[static_cast<std::size_t>(second)];
    double lowest = 1e300;
    std::size_t best_one = kWidths - 1, best_two = kWidths - 1;
    for (std::size_t i = 0; i < kWidths; ++i) {
        for (std::size_t j = 0; j < kWidths; ++j) {
            const bool is_ordered = (one[i].factor - two[j].factor) * (width[i] - width[j]) >= 0;
            if (is_ordered && one[i].cost + two[j].cost < lowest) {
                lowest = one[i].cost + two[j].cost;
                best_one = i;
                best_two = j;
            }
        }
    }
    const auto assign = [&](int c, std::size_t i) {
        TwoExponentials fit = base.scaled(width[i]);
        const double factor = trials[static_cast<std::size_t>(c)][i].factor;
        fit.a *= factor;
        fit.c *= factor;
        const VectorXd y = exitance.col(c);
        const TwoExponentials own = fit_one(histogram, y, c, options);
        const bool is_refuted =
            misfit(histogram, y, c, own) < kRefuted * misfit(histogram, y, c, fit);
        result[static_cast<std::size_t>(c)] = is_refuted ? own : fit;
    };
    assign(first, best_one);
    assign(second, best_two);
    return result;
}

}  // namespace vitrine
