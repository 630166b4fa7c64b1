#include "estimate/caustic_cue.h"

#include "base/rng.h"
#include "math/statistics.h"
#include "render/estimation_columns.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace vitrine {

namespace {

constexpr double kResidualScale = 0.25;  // of the logarithm: hulls blur caustics by about this
constexpr double kFloor = 0.01;          // of the bright level: darker says nothing exact
constexpr double kPlaneTolerance = 0.004;
constexpr std::size_t kMinReceivers = 150;
constexpr int kGatherRays = 48;
constexpr int kDiscSamples = 16;
constexpr int kBootstrapRounds = 40;
// Normals of a hull's lit half shift the index that its caustic asks for by 0.04 to 0.1.
constexpr double kModelIor = 0.06;
constexpr double kMaxResampled = 0.05;  // spread over patches beyond which a caustic tells nothing
constexpr double kMinContrast = 1.1;    // worst index over best: less, and none is preferred
constexpr double kMaxConflict = 3.0;    // deviations

/// What all indices share at the receivers, in luminance.
struct Receivers {
    std::vector<SurfacePoint> points;
    std::vector<double> seen, steady;  // radiance seen; irradiance without the caustic
    std::vector<char> is_clipped;
    std::vector<int> block;
};

Receivers receivers_of(const EstimationScene& scene, const FrameLookup& lookup, int object,
                       const CausticScene& light, std::span<const double> iors,
                       const CausticCueOptions& options) {
    Receivers receivers;
    for (const DiscLight& lamp : light.lights) {
        const ViewReceivers places = caustic_receivers(
            scene, object, lookup.cameras(), {lamp.position_m, lamp.normal, lamp.radius_m}, iors,
            light.opaque_mask, {.pixel_step = options.pixel_step});
        const std::size_t stride =
            std::max<std::size_t>(1, places.points.size() / options.max_receivers);
        for (std::size_t i = 0; i < places.points.size(); i += stride) {
            const Vec3 p = places.points[i].position.cast<double>();
            if (std::abs(light.plane.normal.dot(p) - light.plane.offset) > kPlaneTolerance)
                continue;
            const auto f = static_cast<std::size_t>(places.camera[i]);
            const Rgb& value = lookup.frames()[f].colour(places.x[i], places.y[i]);
            receivers.points.push_back(places.points[i]);
            receivers.seen.push_back(luminance(value));
            receivers.is_clipped.push_back(lookup.is_clipped(value));
            receivers.block.push_back(static_cast<int>(
                stream_key(
                    static_cast<std::uint64_t>(std::floor(p.x() / options.block_size_m) + 4096),
                    static_cast<std::uint64_t>(std::floor(p.y() / options.block_size_m) + 4096)) &
                0x7fffffff));
        }
    }
    const GatheredLight gathered =
        gather_light(scene, receivers.points, kGatherRays, object_mask(object), {}, 0xca05);
    receivers.steady.resize(receivers.points.size());
    for (std::size_t i = 0; i < receivers.points.size(); ++i)
        receivers.steady[i] =
            luminance(Rgb(gathered.bounced[i] + light.ambient * gathered.openness[i]));
    for (const DiscLight& lamp : light.lights) {
        const DirectColumn direct =
            direct_column(scene, receivers.points, {lamp.position_m, lamp.normal, lamp.radius_m},
                          kDiscSamples, light.opaque_mask | object_mask(object), 0);
        for (std::size_t i = 0; i < receivers.points.size(); ++i)
            receivers.steady[i] +=
                static_cast<double>(direct.clear[i]) * luminance(lamp.intensity_w_per_sr);
    }
    return receivers;
}

double geman(double r) {
    const double r2 = r * r;
    return r2 / (r2 + kResidualScale * kResidualScale);
}

/// Loss of every receiver with the albedo (one logarithm) fitted robustly.
std::vector<double> losses(const Receivers& receivers, const std::vector<double>& caustic,
                           double saturation, double floor) {
    const std::size_t n = receivers.seen.size();
    std::vector<double> log_ratio(n), open;
    for (std::size_t i = 0; i < n; ++i) {
        log_ratio[i] = std::log((receivers.seen[i] + floor) /
                                ((receivers.steady[i] + caustic[i]) / kPi + floor));
        if (!receivers.is_clipped[i]) open.push_back(log_ratio[i]);
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
        if (receivers.is_clipped[i]) {
            const double predicted = std::exp(gain) * (receivers.steady[i] + caustic[i]) / kPi;
            d = std::max(0.0, std::log(saturation / std::max(predicted, 1e-9)));  // at least
        }
        loss[i] = geman(d);
    }
    return loss;
}

}  // namespace

CausticCue caustic_cue(const EstimationScene& scene, const FrameLookup& lookup, int object,
                       const CausticScene& light, std::span<const double> iors,
                       const CausticCueOptions& options) {
    CausticCue cue;
    const Receivers receivers = receivers_of(scene, lookup, object, light, iors, options);
    cue.receiver_count = receivers.points.size();
    if (receivers.points.size() < kMinReceivers || light.lights.empty()) return cue;
    std::vector<std::vector<double>> caustic(iors.size(),
                                             std::vector<double>(receivers.points.size(), 0.0));
    const auto grid =
        std::make_shared<const ReceiverGrid>(receivers.points, options.gather_radius_m);
    for (const DiscLight& lamp : light.lights) {
        const CausticColumns columns(
            CausticBeam(scene, object, {lamp.position_m, lamp.normal, lamp.radius_m},
                        light.opaque_mask, {.photon_count = options.photon_count}),
            grid);
        const std::vector<std::vector<Rgb>> column = columns.at(iors, light.sigma_a_per_m);
        for (std::size_t k = 0; k < iors.size(); ++k)
            for (std::size_t i = 0; i < receivers.points.size(); ++i)
                caustic[k][i] += luminance(Rgb(column[k][i] * lamp.intensity_w_per_sr));
    }
    const double floor = kFloor * std::max(1e-6, quantile(receivers.seen, 0.9));

    // Block sums of the loss: resampling patches costs nothing more.
    std::map<int, std::size_t> index_of_block;
    for (const int block : receivers.block)
        index_of_block.try_emplace(block, index_of_block.size());
    const std::size_t blocks = index_of_block.size();
    std::vector<std::vector<double>> sums(iors.size(), std::vector<double>(blocks, 0.0));
    std::vector<double> counts(blocks, 0.0);
    for (const int block : receivers.block) counts[index_of_block[block]] += 1.0;
    for (std::size_t k = 0; k < iors.size(); ++k) {
        const std::vector<double> loss =
            losses(receivers, caustic[k], lookup.saturation_level(), floor);
        double sum = 0.0;
        for (std::size_t i = 0; i < loss.size(); ++i) {
            sums[k][index_of_block[receivers.block[i]]] += loss[i];
            sum += loss[i];
        }
        cue.cost.push_back(sum / static_cast<double>(loss.size()));
    }
    std::vector<double> best_iors;
    for (int round = 0; round < kBootstrapRounds; ++round) {
        Rng rng(stream_key(0xca57u, round));
        std::vector<double> drawn(blocks, 0.0);
        for (std::size_t b = 0; b < blocks; ++b)
            drawn[rng.next_index(static_cast<std::uint32_t>(blocks))] += 1.0;
        double least = 1e30, at = iors[0];
        for (std::size_t k = 0; k < iors.size(); ++k) {
            double sum = 0.0, total = 1e-9;
            for (std::size_t b = 0; b < blocks; ++b) {
                sum += drawn[b] * sums[k][b];
                total += drawn[b] * counts[b];
            }
            if (sum / total < least) {
                least = sum / total;
                at = iors[k];
            }
        }
        best_iors.push_back(at);
    }
    cue.stddev = standard_deviation(best_iors);
    return cue;
}

Estimate<double> combined_index(const Estimate<double>& through, std::span<const double> iors,
                                const CausticCue& cue) {
    if (cue.cost.empty() || cue.stddev > kMaxResampled) return through;
    const auto least = static_cast<std::size_t>(std::min_element(cue.cost.begin(), cue.cost.end()) -
                                                cue.cost.begin());
    const double worst = *std::max_element(cue.cost.begin(), cue.cost.end());
    if (least == 0 || least + 1 == cue.cost.size() || worst < kMinContrast * cue.cost[least])
        return through;
    // Vertex of the parabola through the best index and its neighbours.
    const double before = cue.cost[least - 1], at = cue.cost[least], after = cue.cost[least + 1];
    const double curvature = before + after - 2.0 * at;
    const double step = iors[least + 1] - iors[least];
    const double offset = curvature > 0.0 ? 0.5 * (before - after) / curvature : 0.0;
    const double from_caustic = iors[least] + step * std::clamp(offset, -0.5, 0.5);
    const double sd_caustic = std::hypot(cue.stddev, kModelIor);

    Estimate<double> index = through;
    if (through.outcome != Outcome::Converged) {
        if (through.outcome == Outcome::AtBound) return through;
        index.value = from_caustic;
        index.stddev = sd_caustic;
        index.outcome = Outcome::Converged;
        index.reason = "from its caustic alone: the view through it shows no index";
        return index;
    }
    const double conflict =
        std::abs(from_caustic - through.value) / std::hypot(sd_caustic, through.stddev);
    if (conflict > kMaxConflict || through.stddev <= 0.0) return through;
    const double w_view = 1.0 / (through.stddev * through.stddev);
    const double w_caustic = 1.0 / (sd_caustic * sd_caustic);
    index.value = (w_view * through.value + w_caustic * from_caustic) / (w_view + w_caustic);
    index.stddev = 1.0 / std::sqrt(w_view + w_caustic);
    return index;
}

}  // namespace vitrine
