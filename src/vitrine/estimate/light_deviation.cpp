#include "estimate/light_deviation.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace vitrine {

namespace {

// Deviation of a logarithm that nothing shows: a factor of two, more or less.
constexpr double kUnknownLog = 0.7;
constexpr int kDiscSamples = 16;

// Parameters of each light: two angles, log distance, log radius, log irradiance (of the first
// light fixed: the scale takes it); after all lights the ambient light.
enum Parameter { kAngleX, kAngleY, kLogDistance, kLogRadius, kLogShare, kPerLight };
// Shadows' borders cross samples one by one, so second differences are noisy like one over the
// square of the step: with half of these the curvature is often singular by chance, and deviations
// come out several times too large.
constexpr double kStep[kPerLight] = {0.04, 0.04, 0.16, 0.6, 0.2};
constexpr double kAmbientStep = 0.03;  // of the lights' irradiance on a surface that faces them

/// Lights moved by steps, with the columns of every place that was asked for.
class MovedLights {
  public:
    MovedLights(const LightFit& fit, const LightSet& set) : fit_(fit), set_(set) {
        for (const PolarLight& light : set.lights)
            irradiance_ += light.weight / (light.distance_m * light.distance_m);
        // Less than a step of ambient light cannot be taken away.
        ambient_ratio_ = std::max(set.score.ambient_ratio, ambient_step());
    }
    int count() const { return kPerLight * static_cast<int>(set_.lights.size()) + 1; }
    int ambient() const { return count() - 1; }
    double step(int a) const { return a == ambient() ? kAmbientStep : kStep[a % kPerLight]; }
    bool is_free(int a) const { return a != kLogShare; }

    struct Losses {
        double mean = 0.0, total_weight = 0.0;
        std::vector<double> weighted;  ///< of every sample
        LightScore score;
    };
    /// With parameters `a` and `b` (or -1) off by one step of `sign`.
    Losses at(int a, int b, int sign) {
        LightColumns columns;
        for (int k = 0; k < static_cast<int>(set_.lights.size()); ++k)
            columns.add(column(k, a, b, sign), weight(k, a, b, sign));
        double ratio = ambient_ratio_;
        if (a == ambient() || b == ambient()) ratio += sign * ambient_step();
        Losses losses;
        losses.score = fit_.score_at(columns, 1, kLuminance, ratio);
        std::vector<double> weights;
        fit_.losses(columns, 1, kLuminance, losses.score, losses.weighted, weights);
        for (std::size_t i = 0; i < weights.size(); ++i) {
            losses.weighted[i] *= weights[i];
            losses.mean += losses.weighted[i];
            losses.total_weight += weights[i];
        }
        losses.mean /= std::max(losses.total_weight, 1e-12);
        return losses;
    }
    /// Logarithm of the intensity of light `k` there.
    double log_intensity(int k, const Losses& losses, int a, int sign) const {
        return std::log(std::max(losses.score.intensity, 1e-12) * weight(k, a, -1, sign));
    }

  private:
    double ambient_step() const { return kAmbientStep * irradiance_ / kPi; }
    double moved(int k, Parameter p, int a, int b, int sign) const {
        const int index = kPerLight * k + p;
        return a == index || b == index ? sign * kStep[p] : 0.0;
    }
    /// Irradiance, not intensity, stays while the distance changes.
    double weight(int k, int a, int b, int sign) const {
        return set_.lights[static_cast<std::size_t>(k)].weight *
               std::exp(2.0 * moved(k, kLogDistance, a, b, sign) + moved(k, kLogShare, a, b, sign));
    }
    const DirectColumn& column(int k, int a, int b, int sign) {
        const auto own = [&](int i) {
            return i >= kPerLight * k && i < kPerLight * k + kLogShare ? i : -1;
        };
        const int least = std::min(own(a), own(b)), most = std::max(own(a), own(b));
        const auto key = std::make_tuple(k, least, most, most < 0 ? 0 : sign);
        auto found = columns_.find(key);
        if (found == columns_.end()) {
            PolarLight light = set_.lights[static_cast<std::size_t>(k)];
            light.direction = tilted(light.direction, moved(k, kAngleX, a, b, sign),
                                     moved(k, kAngleY, a, b, sign));
            const double longer = moved(k, kLogDistance, a, b, sign);
            light.distance_m *= std::exp(longer);
            light.radius_m *= std::exp(longer + moved(k, kLogRadius, a, b, sign));
            found = columns_
                        .emplace(key, fit_.column(to_trial(light, fit_.samples().reference_point),
                                                  kDiscSamples, 1))
                        .first;
        }
        return found->second;
    }

    const LightFit& fit_;
    const LightSet& set_;
    double irradiance_ = 0.0, ambient_ratio_ = 0.0;
    std::map<std::tuple<int, int, int, int>, DirectColumn> columns_;
};

bool is_flat(double curvature) {
    constexpr double kFlat = 1e-3;  // of a loss in [0, 1]
    return curvature < kFlat;
}

/// Sum over pairs of blocks of the product of what they say. Paint comes in waves wider than a
/// block: neighbours count as well, by a kernel that keeps the sum positive (Conley 1999).
Eigen::MatrixXd scatter_of(const ScanSamples& samples,
                           const std::map<int, Eigen::VectorXd>& block_sum) {
    constexpr double kReach_m = 0.16;  // two blocks
    std::map<int, std::pair<Vec3, double>> place;
    for (std::size_t i = 0; i < samples.points.size(); ++i) {
        auto& [sum, count] = place.try_emplace(samples.block[i], Vec3::Zero(), 0.0).first->second;
        sum += samples.points[i].position.cast<double>();
        count += 1.0;
    }
    std::vector<std::pair<Vec3, const Eigen::VectorXd*>> blocks;
    for (const auto& [block, sum] : block_sum)
        blocks.emplace_back(place[block].first / place[block].second, &sum);
    const Eigen::Index n = blocks.empty() ? 0 : blocks[0].second->size();
    Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(n, n);
    for (const auto& [here, sum] : blocks)
        for (const auto& [there, other] : blocks) {
            const Eigen::Array3d share = 1.0 - (here - there).array().abs() / kReach_m;
            if (share.minCoeff() > 0.0) scatter += share.prod() * *sum * other->transpose();
        }
    return scatter;
}

/// Inverse of the curvature. Unlike quantities are scaled to unit curvature first; what does not
/// curve at all is left out (zeros), and no combination is taken to be vaguer than 1 / kMinShare:
/// less is the noise of second differences.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& hessian) {
    constexpr double kMinShare = 0.15;
    const Eigen::Index n = hessian.rows();
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(n);
    for (Eigen::Index a = 0; a < n; ++a)
        if (!is_flat(hessian(a, a))) scale[a] = 1.0 / std::sqrt(hessian(a, a));
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * hessian *
                                                                scale.asDiagonal());
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index a = 0; a < n; ++a) {
        const Eigen::VectorXd v = scale.cwiseProduct(solver.eigenvectors().col(a));
        inverse += v * v.transpose() / std::max(solver.eigenvalues()[a], kMinShare);
    }
    return inverse;
}

}  // namespace

std::vector<LightDeviation> light_deviations(const LightFit& fit, const LightSet& set) {
    MovedLights moved(fit, set);
    const int n = moved.count(), light_count = static_cast<int>(set.lights.size());
    const MovedLights::Losses centre = moved.at(-1, -1, 0);

    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(n, n);
    Eigen::MatrixXd intensity_slope = Eigen::MatrixXd::Zero(n, light_count);
    std::map<int, Eigen::VectorXd> block_sum;
    Eigen::VectorXd up = Eigen::VectorXd::Zero(n), down = up;
    for (int a = 0; a < n; ++a) {
        if (!moved.is_free(a)) continue;
        const MovedLights::Losses plus = moved.at(a, -1, 1), minus = moved.at(a, -1, -1);
        const double step = moved.step(a);
        up[a] = plus.mean;
        down[a] = minus.mean;
        hessian(a, a) = (up[a] + down[a] - 2.0 * centre.mean) / (step * step);
        for (std::size_t i = 0; i < plus.weighted.size(); ++i) {
            auto [entry, is_new] =
                block_sum.try_emplace(fit.samples().block[i], Eigen::VectorXd::Zero(n));
            entry->second[a] += (plus.weighted[i] - minus.weighted[i]) / (2.0 * step);
        }
        for (int k = 0; k < light_count; ++k)
            intensity_slope(a, k) =
                (moved.log_intensity(k, plus, a, 1) - moved.log_intensity(k, minus, a, -1)) /
                (2.0 * step);
    }
    for (int a = 0; a < n; ++a) {
        for (int b = a + 1; b < n; ++b) {
            if (!moved.is_free(a) || !moved.is_free(b)) continue;
            const double both = moved.at(a, b, 1).mean + moved.at(a, b, -1).mean;
            hessian(a, b) = hessian(b, a) =
                (both - up[a] - down[a] - up[b] - down[b] + 2.0 * centre.mean) /
                (2.0 * moved.step(a) * moved.step(b));
        }
    }
    Eigen::MatrixXd meat =
        scatter_of(fit.samples(), block_sum) / (centre.total_weight * centre.total_weight);
    std::vector<LightDeviation> deviations(set.lights.size());
    for (int k = 0; k < light_count; ++k) {
        LightDeviation& deviation = deviations[static_cast<std::size_t>(k)];
        const int x = kPerLight * k + kAngleX, y = kPerLight * k + kAngleY;
        deviation.is_identifiable = !is_flat(hessian(x, x)) && !is_flat(hessian(y, y));
        if (!deviation.is_identifiable) continue;
        // Before any picture distance and radius are known within a factor or two, which keeps a
        // penumbra that says nothing of the radius from making the direction vague as well. The
        // loss becomes a likelihood by the scale at which curvature and scatter of the angles
        // agree.
        const double scale =
            (hessian(x, x) + hessian(y, y)) / std::max(meat(x, x) + meat(y, y), 1e-30);
        for (const int a : {kPerLight * k + kLogDistance, kPerLight * k + kLogRadius}) {
            const double prior = 1.0 / (scale * kUnknownLog * kUnknownLog);
            hessian(a, a) = std::max(hessian(a, a), 0.0) + prior;
            meat(a, a) += prior / scale;
        }
    }
    const Eigen::MatrixXd inverse = inverse_of(hessian);
    const Eigen::MatrixXd covariance = inverse * meat * inverse;
    const auto root = [](double variance) { return std::sqrt(std::max(0.0, variance)); };
    for (int k = 0; k < light_count; ++k) {
        LightDeviation& deviation = deviations[static_cast<std::size_t>(k)];
        const int first = kPerLight * k;
        deviation.direction_rad =
            root(0.5 * (covariance(first, first) + covariance(first + 1, first + 1)));
        if (!deviation.is_identifiable) {
            deviation.log_distance = deviation.log_radius = kUnknownLog;
            deviation.log_intensity = deviation.log_irradiance = kUnknownLog;
            continue;
        }
        deviation.log_distance = root(covariance(first + kLogDistance, first + kLogDistance));
        deviation.log_radius = root(covariance(first + kLogRadius, first + kLogRadius));
        Eigen::VectorXd slope = intensity_slope.col(k);
        deviation.log_intensity = root(slope.dot(covariance * slope));
        slope[first + kLogDistance] -= 2.0;
        deviation.log_irradiance = root(slope.dot(covariance * slope));
    }
    return deviations;
}

}  // namespace vitrine
