#include "estimate/distance_histogram.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "image/filter.h"

#include <algorithm>

namespace vitrine {

CappedKernel::CappedKernel(RadialKernel kernel, double rho)
    : kernel_(std::move(kernel)), rho_(rho), value_(kernel_(rho)) {
    const double h = 0.02 * rho;
    const double slope = std::min(0.0, (std::log(std::max(kernel_(rho + h), 1e-300)) -
                                        std::log(std::max(kernel_(rho - h), 1e-300))) /
                                           (2 * h));
    curvature_ = slope / (2 * rho);
    // int 2 pi r (R - cap) dr with r = rho s^2, which tames steep kernels.
    constexpr int kSteps = 200;
    for (int i = 0; i < kSteps; ++i) {
        const double s = (i + 0.5) / kSteps, r = rho * s * s;
        near_share_ += 2 * kPi * r * (kernel_(r) - (*this)(r)) * 2 * rho * s / kSteps;
    }
}

double CappedKernel::operator()(double r) const {
    return r >= rho_ ? kernel_(r) : value_ * std::exp(curvature_ * (r * r - rho_ * rho_));
}

ReliefObservations draw_observations(const Relief& relief, const Mask& excluded, std::size_t count,
                                     double rim_px, double min_cos, std::uint64_t seed) {
    const ImageF rim = distance_to(mask_not(relief.mask));
    std::vector<std::size_t> usable;
    for (std::size_t i = 0; i < relief.mask.size(); ++i) {
        if (relief.mask[i] <= 127 || (!excluded.empty() && excluded[i] > 127)) continue;
        if (rim[i] <= rim_px || relief.normals[i].z() <= min_cos) continue;
        if (relief.is_cluster()) {
            const std::int16_t ball = relief.ball_of[i];
            if (ball < 0 || relief.balls[static_cast<std::size_t>(ball)].is_mostly_hidden) continue;
        }
        usable.push_back(i);
    }
    Rng rng(seed);
    const std::size_t taken = std::min(count, usable.size());
    for (std::size_t k = 0; k < taken; ++k) {
        const std::size_t other = k + rng.next_index(static_cast<std::uint32_t>(usable.size() - k));
        std::swap(usable[k], usable[other]);
    }
    usable.resize(taken);
    std::sort(usable.begin(), usable.end());
    ReliefObservations observations;
    observations.pixel = usable;
    const auto width = static_cast<std::size_t>(relief.mask.width());
    for (const std::size_t i : usable) {
        observations.position.push_back(
            relief.point(static_cast<int>(i % width), static_cast<int>(i / width)));
        observations.normal.push_back(relief.normals[i]);
        if (relief.is_cluster()) observations.ball.push_back(relief.ball_of[i]);
    }
    return observations;
}

SampleRange samples_about(const ReliefSamples& samples, const ReliefObservations& observations,
                          std::size_t p) {
    if (samples.ball.empty()) return {0, samples.position.size()};
    const auto start = samples.ball.begin();  // they come ball by ball
    const auto [first, last] = std::equal_range(start, samples.ball.end(), observations.ball[p]);
    return {static_cast<std::size_t>(first - start), static_cast<std::size_t>(last - start)};
}

Eigen::MatrixXf irradiance_rows(const std::vector<Rgb>& irradiance) {
    Eigen::MatrixXf rows(static_cast<Eigen::Index>(irradiance.size()), 3);
    for (Eigen::Index i = 0; i < rows.rows(); ++i)
        rows.row(i) = irradiance[static_cast<std::size_t>(i)].matrix().transpose();
    return rows;
}

Eigen::MatrixXd exitance_rows(const ImageRgb& picture, const ReliefObservations& observations,
                              double eta) {
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(observations.pixel.size()), 3);
    for (std::size_t p = 0; p < observations.pixel.size(); ++p) {
        rows.row(static_cast<Eigen::Index>(p)) =
            picture[observations.pixel[p]].cast<double>().matrix().transpose() *
            (kPi / leaving_transmittance(observations.normal[p], eta));
    }
    return rows;
}

DistanceHistogram::DistanceHistogram(const ReliefObservations& observations,
                                     const ReliefSamples& samples,
                                     const Eigen::MatrixXf& source_values,
                                     const Eigen::MatrixXf& local_values,
                                     const std::vector<CurvedBodyFactor>& body)
    : step_(samples.step_px),
      observation_count_(observations.position.size()),
      field_count_(source_values.cols()),
      local_(local_values.cast<double>()) {
    VITRINE_CHECK_EQ(static_cast<std::size_t>(source_values.rows()), samples.position.size());
    VITRINE_CHECK_EQ(static_cast<std::size_t>(local_values.rows()), observation_count_);
    Vec3f low = Vec3f::Constant(1e30f), high = Vec3f::Constant(-1e30f);
    for (const Vec3f& p : samples.position) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    // Spacing a fifth of a cell at 0, growing by 6 % per node: finer than any kernel is curved.
    constexpr double kFirst = 0.2, kGrowth = 0.06;
    const double reach = (high - low).norm() + 2 * step_;
    for (int k = 0; nodes_.empty() || nodes_.back() < reach; ++k)
        nodes_.push_back(step_ * kFirst / kGrowth * (std::exp(kGrowth * k) - 1));

    // The node below a distance, looked up: a logarithm per pair would be a third of the work.
    const double lookup_step = 0.5 * (nodes_[1] - nodes_[0]);
    std::vector<std::uint32_t> node_below;
    for (std::uint32_t k = 0; nodes_[k] < reach;) {
        const double r = lookup_step * static_cast<double>(node_below.size());
        while (k + 2 < nodes_.size() && nodes_[k + 1] <= r) ++k;
        node_below.push_back(k);
        if (r >= reach) break;
    }

    const std::size_t fields = static_cast<std::size_t>(field_count_);
    const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> values =
        source_values;
    Eigen::RowVectorXf linear = Eigen::RowVectorXf::Zero(field_count_), quadratic = linear;
    for (Eigen::Index l = 0; l < field_count_ && !body.empty(); ++l) {
        const CurvedBodyFactor& factor = body[body.size() == 1 ? 0 : static_cast<std::size_t>(l)];
        linear[l] = static_cast<float>(factor.linear);
        quadratic[l] = static_cast<float>(factor.quadratic);
    }
    sums_.assign(observation_count_ * nodes_.size() * fields, 0.0f);
    parallel_for(observation_count_, 8, [&](std::size_t p) {
        float* block = &sums_[p * nodes_.size() * fields];
        Eigen::RowVectorXf row(field_count_);
        const SampleRange about = samples_about(samples, observations, p);
        for (std::size_t i = about.first; i < about.last; ++i) {
            const double r = (samples.position[i] - observations.position[p]).norm();
            std::size_t k = node_below[std::min(static_cast<std::size_t>(r / lookup_step),
                                                node_below.size() - 1)];
            if (k + 2 < nodes_.size() && nodes_[k + 1] <= r) ++k;  // half a step at most
            const auto t = static_cast<float>(
                std::clamp((r - nodes_[k]) / (nodes_[k + 1] - nodes_[k]), 0.0, 1.0));
            Eigen::Map<Eigen::RowVectorXf> lower(block + k * fields, field_count_);
            Eigen::Map<Eigen::RowVectorXf> upper(block + (k + 1) * fields, field_count_);
            row = values.row(static_cast<Eigen::Index>(i));
            const float rise = chord_rise(samples.position[i], samples.normal[i],
                                          observations.position[p], observations.normal[p]);
            if (rise > 0 && !body.empty())
                row.array() *= 1 + rise * (linear.array() + rise * quadratic.array());
            lower += (1 - t) * row;
            upper += t * row;
        }
    });
}

Eigen::MatrixXd DistanceHistogram::image_of_nodes(const Eigen::VectorXd& values) const {
    VITRINE_CHECK_EQ(static_cast<std::size_t>(values.size()), nodes_.size());
    Eigen::MatrixXd result(static_cast<Eigen::Index>(observation_count_), field_count_);
    const std::size_t fields = static_cast<std::size_t>(field_count_);
    parallel_for(observation_count_, 32, [&](std::size_t p) {
        const float* block = &sums_[p * nodes_.size() * fields];
        std::vector<double> sum(fields, 0.0);
        for (std::size_t k = 0; k < nodes_.size(); ++k) {
            const double value = values[static_cast<Eigen::Index>(k)];
            for (std::size_t l = 0; l < fields; ++l) sum[l] += value * block[k * fields + l];
        }
        for (std::size_t l = 0; l < fields; ++l)
            result(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(l)) = sum[l];
    });
    return result;
}

Eigen::MatrixXd DistanceHistogram::image_of(const RadialKernel& kernel) const {
    const CappedKernel capped(kernel, 1.5 * step_);
    Eigen::VectorXd far(static_cast<Eigen::Index>(nodes_.size()));
    for (std::size_t k = 0; k < nodes_.size(); ++k)
        far[static_cast<Eigen::Index>(k)] = capped(nodes_[k]);
    // Straight lines between nodes lie above a kernel that falls ever more slowly, by h^2 R'' / 12
    // in the mean: nodes that much lower.
    Eigen::VectorXd lower = far;
    for (Eigen::Index k = 1; k + 1 < far.size(); ++k)
        lower[k] -= (far[k + 1] - 2 * far[k] + far[k - 1]) / 12;
    far = lower;
    return image_of_nodes(far) + capped.near_share() * local_;
}

}  // namespace vitrine
