#include "estimate/light_fit.h"

#include "math/optimise.h"
#include "math/statistics.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr double kResidualScale = 0.15;   // texture and geometry leave about this much in the log
constexpr double kFloor = 0.002;          // of the direct level: light the model does not follow
constexpr double kDarkLevel = 0.03;       // of the bright level: darker samples weigh less
constexpr double kMeanAlbedo = 0.5;       // assumed when no albedo is known
constexpr double kMaxAmbientShare = 0.6;  // of the direct irradiance, on an open surface
constexpr int kReferenceRays = 1024;

double channel_of(const Rgb& value, int channel) {
    return channel == kLuminance ? luminance(value) : value[channel];
}

double geman(double r) {
    const double r2 = r * r;
    return r2 / (r2 + kResidualScale * kResidualScale);
}

}  // namespace

LightColumns& LightColumns::add(const DirectColumn& column, double weight) {
    if (clear.empty()) {
        clear.assign(column.clear.size(), 0.0f);
        through.assign(column.through.size(), 0.0f);
    }
    for (std::size_t i = 0; i < clear.size(); ++i) {
        clear[i] += static_cast<float>(weight) * column.clear[i];
        through[i] += static_cast<float>(weight) * column.through[i];
    }
    return *this;
}

LightFit::LightFit(const EstimationScene& scene, const ScanSamples& samples,
                   const std::optional<ReferenceSample>& reference, std::uint32_t opaque_mask,
                   std::uint32_t see_through_mask, std::uint64_t seed)
    : scene_(scene),
      samples_(samples),
      reference_(reference),
      opaque_mask_(opaque_mask),
      see_through_mask_(see_through_mask) {
    std::vector<double> level;
    for (const Rgb& l : samples.radiance) level.push_back(luminance(l));
    const double dark = level.empty() ? 1e-3 : kDarkLevel * quantile(level, 0.9) + 1e-6;
    log_radiance_.resize(4);
    for (const Rgb& l : samples.radiance) {
        for (int c = 0; c < 4; ++c)
            log_radiance_[static_cast<std::size_t>(c)].push_back(
                static_cast<float>(std::log(std::max(channel_of(l, c), 0.02 * dark))));
        const double y = luminance(l);
        weight_.push_back(static_cast<float>(y * y / (y * y + dark * dark)));
    }
    if (reference_)
        at_reference_ = gather_light(scene, std::span(&reference_->point, 1), kReferenceRays,
                                     see_through_mask, {}, seed);
}

std::size_t LightFit::count(int stride) const {
    const auto s = static_cast<std::size_t>(stride);
    return (samples_.points.size() + s - 1) / s;
}

DirectColumn LightFit::column(const TrialLight& light, int disc_samples, int stride) const {
    std::vector<SurfacePoint> points;
    points.reserve(count(stride) + 1);
    for (std::size_t i = 0; i < samples_.points.size(); i += static_cast<std::size_t>(stride))
        points.push_back(samples_.points[i]);
    if (reference_) points.push_back(reference_->point);
    return direct_column(scene_, points, light, disc_samples, opaque_mask_, see_through_mask_);
}

double LightFit::irradiance(const LightColumns& columns, std::size_t row, std::size_t sample,
                            int channel, double b, double g) const {
    return columns.clear[row] + b * samples_.gathered.openness[sample] +
           g * channel_of(samples_.gathered.bounced[sample], channel);
}

LightScore LightFit::score_at(const LightColumns& columns, int stride, int channel,
                              double b) const {
    LightScore result;
    result.ambient_ratio = b;
    const std::size_t n = count(stride);
    const auto step = static_cast<std::size_t>(stride);
    const auto& log_l = log_radiance_[static_cast<std::size_t>(channel)];

    std::vector<float> sorted(columns.clear.begin(), columns.clear.begin() + static_cast<long>(n));
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(9 * n / 10), sorted.end());
    const double bright = sorted[9 * n / 10];
    if (bright <= 0.0) return result;

    double intensity = is_intensity_known_ ? 1.0 : 0.0;
    bool is_anchored = is_intensity_known_;
    if (reference_ && !is_intensity_known_) {
        const double e = columns.clear[n] + b * at_reference_.openness[0];
        const double wanted = kPi * channel_of(reference_->radiance, channel) /
                                  channel_of(reference_->albedo, channel) -
                              channel_of(at_reference_.bounced[0], channel);
        if (e > 0.05 * bright && wanted > 0.0) {
            intensity = wanted / e;
            is_anchored = true;
        }
    }
    std::vector<std::vector<std::pair<float, float>>> residuals(
        static_cast<std::size_t>(samples_.cluster_count));
    std::vector<double> share(residuals.size(), 0.0);
    std::vector<float> values;
    for (int round = 0; round < (is_anchored ? 1 : 2); ++round) {
        const double g = intensity > 0.0 ? 1.0 / intensity : 0.0;
        for (auto& list : residuals) list.clear();
        for (std::size_t row = 0; row < n; ++row) {
            const std::size_t i = row * step;
            const int cluster = samples_.cluster[i];
            if (cluster < 0) continue;
            const double e = irradiance(columns, row, i, channel, b, g) + kFloor * bright;
            const float lit = columns.clear[row], hidden = columns.through[row];
            const float w = weight_[i] * (hidden > 0.0f ? lit / (lit + hidden) : 1.0f);
            residuals[static_cast<std::size_t>(cluster)].emplace_back(
                log_l[i] - static_cast<float>(std::log(e)), w);
        }
        result.log_gain.assign(residuals.size(), 0.0);
        double cost = 0.0, weight = 0.0, square = 0.0, inlier = 0.0, albedo = 0.0;
        for (std::size_t c = 0; c < residuals.size(); ++c) {
            if (residuals[c].empty()) continue;
            values.clear();
            for (const auto& [r, w] : residuals[c]) values.push_back(r);
            std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2),
                             values.end());
            double m = values[values.size() / 2];
            constexpr double s2 = kResidualScale * kResidualScale;
            for (int irls = 0; irls < 6; ++irls) {
                double sum = 0.0, total = 1e-9;
                for (const auto& [r, w] : residuals[c]) {
                    const double d = r - m;
                    const double v = w / ((d * d + s2) * (d * d + s2));
                    sum += v * d;
                    total += v;
                }
                m += sum / total;
            }
            result.log_gain[c] = m;
            double cluster_weight = 0.0;
            for (const auto& [r, w] : residuals[c]) {
                const double d = r - m;
                cost += w * geman(d);
                cluster_weight += w;
                if (std::abs(d) < 2.0 * kResidualScale) {
                    square += w * d * d;
                    inlier += w;
                }
            }
            weight += cluster_weight;
            albedo += cluster_weight * std::exp(m);
        }
        if (weight <= 0.0) return result;
        result.cost = cost / weight;
        result.residual_rms = std::sqrt(square / std::max(inlier, 1e-9));
        if (!is_anchored) intensity = kPi * (albedo / weight) / kMeanAlbedo;
    }
    result.intensity = intensity;
    return result;
}

double LightFit::max_ambient_ratio(const LightColumns& columns, int stride) const {
    std::vector<float> sorted(columns.clear.begin(),
                              columns.clear.begin() + static_cast<long>(count(stride)));
    const std::size_t k = 9 * sorted.size() / 10;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(k), sorted.end());
    return sorted[k] > 0.0f ? kMaxAmbientShare * sorted[k] / kPi : 0.0;
}

LightScore LightFit::score(const LightColumns& columns, int stride, int channel) const {
    const double limit = max_ambient_ratio(columns, stride);
    if (limit <= 0.0) return {};
    // b enters as a square: fine steps near zero, where it most often is.
    const Minimum1d best =
        minimise_golden([&](double t) { return score_at(columns, stride, channel, t * t).cost; },
                        0.0, std::sqrt(limit), 9);
    LightScore with = score_at(columns, stride, channel, best.x * best.x);
    LightScore without = score_at(columns, stride, channel, 0.0);
    return without.cost <= with.cost ? without : with;
}

LightScore LightFit::score_near(const LightColumns& columns, int stride, int channel,
                                double b) const {
    constexpr double kFactor = 3.0;
    constexpr double kLeastShare = 0.03;  // of the greatest ratio: none at all in luminance
    const double limit = max_ambient_ratio(columns, stride);
    const Minimum1d best = minimise_golden(
        [&](double t) { return score_at(columns, stride, channel, t * t).cost; },
        std::sqrt(b / kFactor), std::sqrt(std::min(limit, kFactor * b + kLeastShare * limit)), 9);
    LightScore with = score_at(columns, stride, channel, best.x * best.x);
    LightScore as_luminance = score_at(columns, stride, channel, b);
    return as_luminance.cost <= with.cost ? as_luminance : with;
}

void LightFit::losses(const LightColumns& columns, int stride, int channel, const LightScore& score,
                      std::vector<double>& loss, std::vector<double>& weight) const {
    const std::size_t n = count(stride);
    loss.assign(n, 0.0);
    weight.assign(n, 0.0);
    std::vector<float> sorted(columns.clear.begin(), columns.clear.begin() + static_cast<long>(n));
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(9 * n / 10), sorted.end());
    const double bright = sorted[9 * n / 10];
    const double g = score.intensity > 0.0 ? 1.0 / score.intensity : 0.0;
    for (std::size_t row = 0; row < n; ++row) {
        const std::size_t i = row * static_cast<std::size_t>(stride);
        const int cluster = samples_.cluster[i];
        if (cluster < 0 || score.log_gain.empty()) continue;
        const double e =
            irradiance(columns, row, i, channel, score.ambient_ratio, g) + kFloor * bright;
        const float lit = columns.clear[row], hidden = columns.through[row];
        weight[row] = weight_[i] * (hidden > 0.0f ? lit / (lit + hidden) : 1.0f);
        loss[row] = geman(log_radiance_[static_cast<std::size_t>(channel)][i] - std::log(e) -
                          score.log_gain[static_cast<std::size_t>(cluster)]);
    }
}

}  // namespace vitrine
