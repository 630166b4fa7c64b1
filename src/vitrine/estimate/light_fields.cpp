#include "estimate/light_fields.h"

#include "base/parallel.h"

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
        fill(result.patch, bounce_->patches(), directions, with_sky ? &bounce_->patch_sky() : nullptr);
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

KernelImage::KernelImage(const LitRelief& object, const RadialKernel& kernel,
                         const CurvedBodyFactor& body)
    : far_(static_cast<Index>(object.observations().position.size()),
           static_cast<Index>(object.samples().position.size())) {
    const ReliefSamples& samples = object.samples();
    const ReliefObservations& observations = object.observations();
    const CappedKernel capped(kernel, 1.5 * samples.step_px);
    near_ = capped.near_share();
    parallel_for(observations.position.size(), 8, [&](std::size_t p) {
        for (std::size_t i = 0; i < samples.position.size(); ++i) {
            float& entry = far_(static_cast<Index>(p), static_cast<Index>(i));
            entry = 0;
            if (!samples.ball.empty() && samples.ball[i] != observations.ball[p]) continue;
            const float rise = chord_rise(samples.position[i], samples.normal[i],
                                          observations.position[p], observations.normal[p]);
            entry = static_cast<float>(
                capped((samples.position[i] - observations.position[p]).norm()) * body(rise));
        }
    });
}

Eigen::MatrixXd KernelImage::operator()(const LightFields& fields) const {
    return (far_ * fields.source).cast<double>() + near_ * fields.local.cast<double>();
}

}  // namespace vitrine
