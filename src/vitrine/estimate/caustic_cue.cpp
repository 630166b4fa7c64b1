#include "estimate/caustic_cue.h"

#include "base/rng.h"
#include "estimate/model_error.h"
#include "math/statistics.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace vitrine {

namespace {

constexpr std::size_t kMinReceivers = 150;
constexpr int kBootstrapRounds = 40;
constexpr double kMaxResampled = 0.05;  // spread over patches beyond which a caustic tells nothing
constexpr double kMinContrast = 1.1;    // worst index over best: less, and none is preferred
constexpr double kMaxConflict = 3.0;    // deviations

}  // namespace

CausticCue caustic_cue(const EstimationScene& scene, const FrameLookup& lookup, int object,
                       const CausticScene& light, std::span<const double> iors,
                       const CausticCueOptions& options) {
    CausticCue cue;
    const CausticPlaces places(scene, lookup, object, light, iors, options);
    cue.receiver_count = places.size();
    if (places.size() < kMinReceivers || light.lights.empty()) return cue;
    const std::vector<double> steady = places.steady(light.lights);
    const std::vector<std::vector<double>> caustic = places.caustic(light.lights, iors);

    // Block sums of the loss: resampling patches costs nothing more.
    std::map<int, std::size_t> index_of_block;
    for (const int block : places.block()) index_of_block.try_emplace(block, index_of_block.size());
    const std::size_t blocks = index_of_block.size();
    std::vector<std::vector<double>> sums(iors.size(), std::vector<double>(blocks, 0.0));
    std::vector<double> counts(blocks, 0.0);
    for (const int block : places.block()) counts[index_of_block[block]] += 1.0;
    for (std::size_t k = 0; k < iors.size(); ++k) {
        const std::vector<double> loss = places.losses(steady, caustic[k]);
        double sum = 0.0;
        for (std::size_t i = 0; i < loss.size(); ++i) {
            sums[k][index_of_block[places.block()[i]]] += loss[i];
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
    const double sd_caustic = std::hypot(cue.stddev, kCausticIor);

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
