#include "estimate/caustic_places.h"

#include "base/rng.h"
#include "math/statistics.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace vitrine {

namespace {

constexpr double kResidualScale = 0.25;  // of the logarithm: hulls blur caustics by about this
constexpr double kFloor = 0.01;          // of the bright level: darker says nothing exact
constexpr double kPlaneTolerance = 0.004;
constexpr int kGatherRays = 48;
constexpr int kDiscSamples = 16;

TrialLight trial(const DiscLight& lamp) { return {lamp.position_m, lamp.normal, lamp.radius_m}; }

double geman(double r) {
    const double r2 = r * r;
    return r2 / (r2 + kResidualScale * kResidualScale);
}

}  // namespace

CausticPlaces::CausticPlaces(const EstimationScene& scene, const FrameLookup& lookup, int object,
                             const CausticScene& light, std::span<const double> iors,
                             const CausticCueOptions& options)
    : scene_(scene),
      object_(object),
      sigma_a_per_m_(light.sigma_a_per_m),
      opaque_mask_(light.opaque_mask),
      options_(options),
      saturation_level_(lookup.saturation_level()) {
    for (const DiscLight& lamp : light.lights) {
        const ViewReceivers places =
            caustic_receivers(scene, object, lookup.cameras(), trial(lamp), iors, opaque_mask_,
                              {.pixel_step = options.pixel_step});
        const std::size_t stride =
            std::max<std::size_t>(1, places.points.size() / options.max_receivers);
        for (std::size_t i = 0; i < places.points.size(); i += stride) {
            const Vec3 p = places.points[i].position.cast<double>();
            if (std::abs(light.plane.normal.dot(p) - light.plane.offset) > kPlaneTolerance)
                continue;
            const auto f = static_cast<std::size_t>(places.camera[i]);
            const Rgb& value = lookup.frames()[f].colour(places.x[i], places.y[i]);
            points_.push_back(places.points[i]);
            seen_.push_back(luminance(value));
            is_clipped_.push_back(lookup.is_clipped(value));
            block_.push_back(static_cast<int>(
                stream_key(
                    static_cast<std::uint64_t>(std::floor(p.x() / options.block_size_m) + 4096),
                    static_cast<std::uint64_t>(std::floor(p.y() / options.block_size_m) + 4096)) &
                0x7fffffff));
        }
    }
    const GatheredLight gathered =
        gather_light(scene, points_, kGatherRays, object_mask(object), {}, 0xca05);
    for (std::size_t i = 0; i < points_.size(); ++i)
        gathered_.push_back(
            luminance(Rgb(gathered.bounced[i] + light.ambient * gathered.openness[i])));
    if (!seen_.empty()) floor_ = kFloor * std::max(1e-6, quantile(seen_, 0.9));
    if (!points_.empty())
        grid_ = std::make_shared<const ReceiverGrid>(points_, options.gather_radius_m);
}

double CausticPlaces::patch_count() const {
    return static_cast<double>(std::set<int>(block_.begin(), block_.end()).size());
}

std::vector<double> CausticPlaces::steady(const std::vector<DiscLight>& lamps) const {
    std::vector<double> sum = gathered_;
    for (const DiscLight& lamp : lamps) {
        const DirectColumn direct = direct_column(scene_, points_, trial(lamp), kDiscSamples,
                                                  opaque_mask_ | object_mask(object_), 0);
        for (std::size_t i = 0; i < points_.size(); ++i)
            sum[i] += static_cast<double>(direct.clear[i]) * luminance(lamp.intensity_w_per_sr);
    }
    return sum;
}

std::vector<std::vector<double>> CausticPlaces::caustic(const std::vector<DiscLight>& lamps,
                                                        std::span<const double> iors) const {
    std::vector<std::vector<double>> sum(iors.size(), std::vector<double>(points_.size(), 0.0));
    for (const DiscLight& lamp : lamps) {
        const CausticColumns columns(CausticBeam(scene_, object_, trial(lamp), opaque_mask_,
                                                 {.photon_count = options_.photon_count}),
                                     grid_);
        const std::vector<std::vector<Rgb>> column = columns.at(iors, sigma_a_per_m_);
        for (std::size_t k = 0; k < iors.size(); ++k)
            for (std::size_t i = 0; i < points_.size(); ++i)
                sum[k][i] += luminance(Rgb(column[k][i] * lamp.intensity_w_per_sr));
    }
    return sum;
}

std::vector<double> CausticPlaces::losses(const std::vector<double>& steady,
                                          const std::vector<double>& caustic) const {
    const std::size_t n = seen_.size();
    std::vector<double> log_ratio(n), open;
    for (std::size_t i = 0; i < n; ++i) {
        log_ratio[i] = std::log((seen_[i] + floor_) / ((steady[i] + caustic[i]) / kPi + floor_));
        if (!is_clipped_[i]) open.push_back(log_ratio[i]);
    }
    double gain = open.empty() ? 0.0 : median(open);
    constexpr double s2 = kResidualScale * kResidualScale;
    for (int round = 0; round < 6; ++round) {
        double sum = 0.0, total = 1e-9;
        for (const double r : open) {
            const double d = r - gain, w = 1.0 / ((d * d + s2) * (d * d + s2));
            sum += w * d;
            total += w;
        }
        gain += sum / total;
    }
    std::vector<double> loss(n);
    for (std::size_t i = 0; i < n; ++i) {
        double d = log_ratio[i] - gain;
        if (is_clipped_[i]) {
            const double predicted = std::exp(gain) * (steady[i] + caustic[i]) / kPi;
            d = std::max(0.0, std::log(saturation_level_ / std::max(predicted, 1e-9)));
        }
        loss[i] = geman(d);
    }
    return loss;
}

double CausticPlaces::cost(const std::vector<DiscLight>& lamps, double ior) const {
    const std::vector<double> loss =
        losses(steady(lamps), caustic(lamps, std::span(&ior, 1)).front());
    double sum = 0.0;
    for (const double l : loss) sum += l;
    return loss.empty() ? 1.0 : sum / static_cast<double>(loss.size());
}

}  // namespace vitrine
