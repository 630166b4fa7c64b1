#include "estimate/light_fields.h"

#include "base/parallel.h"

#include <algorithm>

namespace vitrine {

using Eigen::Index;

LitRelief::LitRelief(const Relief& relief, ReliefSamples samples, ReliefObservations observations,
                     double eta, bool use_shadows)
    : occluder_(relief),
      samples_(std::move(samples)),
      observations_(std::move(observations)),
      sample_points_{samples_.position, samples_.normal, samples_.ball},
      observation_points_{observations_.position, observations_.normal, observations_.ball},
      eta_(eta),
      use_shadows_(use_shadows) {
    if (!relief.is_cluster() || !use_shadows) {
        sample_sky_ = sky_shares(occluder_, sample_points_);
        observation_sky_ = sky_shares(occluder_, observation_points_);
        return;
    }
    bounce_.emplace(relief);
    BallBounce::View samples_view = bounce_->view_from(sample_points_);
    BallBounce::View observations_view = bounce_->view_from(observation_points_);
    sample_view_ = std::move(samples_view.patches);
    sample_sky_ = std::move(samples_view.sky);
    observation_view_ = std::move(observations_view.patches);
    observation_sky_ = std::move(observations_view.sky);
}

void LitRelief::fill(Eigen::MatrixXf& field, const SurfacePoints& points,
                     const std::vector<Vec3>& directions, const SkyShares* sky) const {
    const auto count = static_cast<Index>(directions.size());
    const auto rows = static_cast<Index>(points.position.size());
    field.resize(rows, count + (sky == nullptr ? 0 : 2));
    for (Index l = 0; l < count; ++l) {
        const Vec3& direction = directions[static_cast<std::size_t>(l)];
        std::vector<float> seen(points.position.size(), 1.0f);
        if (use_shadows_) seen = occluder_.visibility(points, direction);
        for (Index i = 0; i < rows; ++i) {
            const auto k = static_cast<std::size_t>(i);
            field(i, l) = seen[k] * static_cast<float>(
                                        entering_irradiance(points.normal[k], direction, eta_));
        }
    }
    if (sky == nullptr) return;
    for (Index i = 0; i < rows; ++i) {
        field(i, count) = sky->ambient[static_cast<std::size_t>(i)];
        field(i, count + 1) = sky->below[static_cast<std::size_t>(i)];
    }
}

LightFields LitRelief::fields(const std::vector<Vec3>& directions, bool with_sky) const {
    LightFields result;
    fill(result.source, sample_points_, directions, with_sky ? &sample_sky_ : nullptr);
    fill(result.local, observation_points_, directions, with_sky ? &observation_sky_ : nullptr);
    if (bounce_)
        fill(result.patch, bounce_->patches(), directions,
             with_sky ? &bounce_->patch_sky() : nullptr);
    for (Index i = 0; i < result.source.rows(); ++i)
        result.source.row(i) *= samples_.area_px2[static_cast<std::size_t>(i)];
    return result;
}

LightFields LitRelief::bounced(const LightFields& direct, double albedo) const {
    if (!bounce_ || albedo <= 0) return direct;
    LightFields result = direct;
    const Eigen::MatrixXf exitance = bounce_->exitance(direct.patch, albedo);
    Eigen::MatrixXf added = sample_view_ * exitance;
    for (Index i = 0; i < added.rows(); ++i)
        added.row(i) *= samples_.area_px2[static_cast<std::size_t>(i)];
    result.source += added;
    result.local += observation_view_ * exitance;
    return result;
}

LightPaths::LightPaths(const LitRelief& object) : step_px_(object.samples().step_px) {
    const ReliefSamples& samples = object.samples();
    const ReliefObservations& observations = object.observations();
    std::size_t path_count = 0;
    for (std::size_t p = 0; p < observations.position.size(); ++p) {
        const SampleRange about = samples_about(samples, observations, p);
        bundles_.push_back({static_cast<Index>(about.first),
                            static_cast<Index>(about.last - about.first), path_count});
        path_count += about.last - about.first;
    }
    distance_.resize(path_count);
    rise_.resize(path_count);
    parallel_for(bundles_.size(), 8, [&](std::size_t p) {
        const Bundle& bundle = bundles_[p];
        for (Index k = 0; k < bundle.sample_count; ++k) {
            const auto i = static_cast<std::size_t>(bundle.first_sample + k);
            const std::size_t path = bundle.begin + static_cast<std::size_t>(k);
            distance_[path] = (samples.position[i] - observations.position[p]).norm();
            rise_[path] = chord_rise(samples.position[i], samples.normal[i],
                                     observations.position[p], observations.normal[p]);
        }
    });
    for (const float r : distance_) reach_px_ = std::max(reach_px_, r);
}

namespace {

/// Kernels on a grid of distances finer than any is curved, read between its nodes.
class KernelTables {
  public:
    KernelTables(const std::vector<CappedKernel>& kernels, double step_px, float reach_px)
        : count_(kernels.size()), per_px_(static_cast<float>(50 / step_px)) {
        const auto node_count = static_cast<std::size_t>(reach_px * per_px_) + 2;
        values_.reserve(node_count * count_);
        for (std::size_t node = 0; node < node_count; ++node)
            for (const CappedKernel& kernel : kernels)
                values_.push_back(value(kernel, static_cast<double>(node) / per_px_));
    }
    /// Writes factor * R_k(r) for each kernel k.
    void read(float r, float factor, float* out) const {
        const float u = r * per_px_;
        const auto node = static_cast<std::size_t>(u);
        const float t = u - static_cast<float>(node);
        const float *low = &values_[node * count_], *high = low + count_;
        for (std::size_t k = 0; k < count_; ++k)
            out[k] = factor * (low[k] + t * (high[k] - low[k]));
    }

  private:
    /// What is too little to matter is 0: sums of denormal numbers take ten times as long.
    static float value(const CappedKernel& kernel, double r) {
        constexpr double kLeast = 1e-15;
        const double rd = kernel(r);
        return rd < kLeast * kernel(0) ? 0 : static_cast<float>(rd);
    }

    std::size_t count_;
    float per_px_;
    std::vector<float> values_;  ///< [node][kernel]
};

float gain(const CurvedBodyFactor& body, float rise) {
    return 1 + rise * (static_cast<float>(body.linear) + rise * static_cast<float>(body.quadratic));
}

}  // namespace

std::vector<Eigen::MatrixXd> LightPaths::images(const std::vector<RadialKernel>& kernels,
                                                const LightFields& fields,
                                                const CurvedBodyFactor& body) const {
    std::vector<CappedKernel> capped;
    std::vector<Eigen::MatrixXd> result;
    for (const RadialKernel& kernel : kernels) {
        capped.emplace_back(kernel, 1.5 * step_px_);
        result.emplace_back(capped.back().near_share() * fields.local.cast<double>());
    }
    const KernelTables tables(capped, step_px_, reach_px_);
    parallel_for(bundles_.size(), 8, [&](std::size_t p) {
        const Bundle& bundle = bundles_[p];
        Eigen::MatrixXf far(static_cast<Index>(kernels.size()), bundle.sample_count);
        for (Index k = 0; k < bundle.sample_count; ++k) {
            const std::size_t path = bundle.begin + static_cast<std::size_t>(k);
            tables.read(distance_[path], gain(body, rise_[path]), far.col(k).data());
        }
        const Eigen::MatrixXf light =
            far * fields.source.middleRows(bundle.first_sample, bundle.sample_count);
        for (std::size_t k = 0; k < kernels.size(); ++k) {
            result[k].row(static_cast<Index>(p)) += light.row(static_cast<Index>(k)).cast<double>();
        }
    });
    return result;
}

KernelImage::KernelImage(const LightPaths& paths, const RadialKernel& kernel,
                         const CurvedBodyFactor& body)
    : bundles_(paths.bundles_), far_(paths.distance_.size()) {
    const CappedKernel capped(kernel, 1.5 * paths.step_px_);
    near_ = capped.near_share();
    const KernelTables table({capped}, paths.step_px_, paths.reach_px_);
    parallel_for(far_.size(), 4096, [&](std::size_t path) {
        table.read(paths.distance_[path], gain(body, paths.rise_[path]), &far_[path]);
    });
}

Eigen::MatrixXd KernelImage::operator()(const LightFields& fields) const {
    Eigen::MatrixXd result = near_ * fields.local.cast<double>();
    parallel_for(bundles_.size(), 32, [&](std::size_t p) {
        const LightPaths::Bundle& bundle = bundles_[p];
        const Eigen::Map<const Eigen::VectorXf> far(&far_[bundle.begin], bundle.sample_count);
        for (Index l = 0; l < result.cols(); ++l) {
            result(static_cast<Index>(p), l) +=
                far.dot(fields.source.col(l).segment(bundle.first_sample, bundle.sample_count));
        }
    });
    return result;
}

IntensityEquations::IntensityEquations(Index light_count)
    : gram(Eigen::MatrixXd::Zero(light_count, light_count)),
      right(Eigen::VectorXd::Zero(light_count)) {}

void IntensityEquations::add(const Eigen::MatrixXd& image, const Eigen::VectorXd& y,
                             const Eigen::VectorXd& weight) {
    const Eigen::MatrixXd a = weight.asDiagonal() * image;
    const Eigen::VectorXd b = weight.cwiseProduct(y);
    gram += a.transpose() * a;
    right += a.transpose() * b;
    observed += b.squaredNorm();
}

double IntensityEquations::misfit(const Eigen::VectorXd& intensity) const {
    return observed + intensity.dot(gram * intensity) - 2 * right.dot(intensity);
}

}  // namespace vitrine
