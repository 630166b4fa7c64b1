#include "estimate/find_lights.h"

#include "base/log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

constexpr int kScoutStride = 3;        // one third of the samples finds the basin
constexpr int kDensePerCandidate = 4;  // shadows of small things lock within half a step of it
constexpr double kStartSeparationRad = 0.35;         // one and a half steps of the dense grid
constexpr double kBasinRad = 0.17;                   // ends nearer to each other are one answer
constexpr std::size_t kStarts = 10, kFinalists = 3;  // single lights
constexpr std::size_t kFirsts = 24;                  // grid lights to pair with all others
constexpr std::size_t kPairStarts = 6;
// More lights leave a smaller cost whatever is true. On made worlds (seeds 1000 to 1047) with one
// lamp a second gains up to 5 % of it, with two at least 23 %, 3.5 deviations from block to block.
constexpr double kSecondLightGain = 0.08, kSecondLightEvidence = 2.0;
constexpr double kDoubtfulGain = 0.04, kDoubtfulEvidence = 1.5;
constexpr double kModelCost = 0.02;       // what the model itself gets wrong, 2 % in the logarithm
constexpr double kMinSecondShare = 0.08;  // of the irradiance: weaker ones are texture
constexpr double kMinSeparationRad = 0.436;  // 25 degrees: nearer ones pass for one large light
constexpr int kRestarts = 3;
constexpr double kSettled = 0.995;  // a restart that gains less is the last

/// Whether every light of one stands near one of the other.
bool is_same_place(const LightSet& a, const LightSet& b, double separation_rad) {
    return std::all_of(a.lights.begin(), a.lights.end(), [&](const PolarLight& light) {
        return std::any_of(b.lights.begin(), b.lights.end(), [&](const PolarLight& other) {
            return angle_between(light.direction, other.direction) < separation_rad;
        });
    });
}

/// The first `count` of `sets` (best first) that stand apart from all before them.
std::vector<LightSet> distinct(const std::vector<LightSet>& sets, double separation_rad,
                               std::size_t count) {
    std::vector<LightSet> kept;
    for (const LightSet& set : sets) {
        if (kept.size() == count) break;
        if (std::none_of(kept.begin(), kept.end(), [&](const LightSet& other) {
                return is_same_place(set, other, separation_rad);
            }))
            kept.push_back(set);
    }
    return kept;
}

/// Each refined, a distant light staying distant; best first.
std::vector<LightSet> refined(const LightFit& fit, const std::vector<LightSet>& starts,
                              RefineOptions options) {
    std::vector<LightSet> ends;
    for (const LightSet& start : starts) {
        options.keep_distances = has_distant(fit, start);
        ends.push_back(refine_lights(fit, start, options));
    }
    sort_by_cost(ends);
    return ends;
}

RefineOptions scout(int evaluations) {
    return {.stride = kScoutStride,
            .disc_samples = 8,
            .max_evaluations = evaluations,
            .step_rad = 0.12,
            .refine_radius = false};
}

RefineOptions fine(int evaluations) {
    return {.stride = 1, .disc_samples = 16, .max_evaluations = evaluations, .step_rad = 0.04};
}

/// Lamps several times smaller and larger are tried, since penumbrae narrower than a sample's
/// footprint all look alike and a simplex stays with what it started from. But only where the scan
/// insists: on a flat stretch the least cost is chance.
LightSet with_likely_radii(const LightFit& fit, LightSet set, const RefineOptions& options) {
    constexpr double kMaxRadiusPerDistance = 0.3;
    constexpr double kRadiusEvidence = 2.0;  // deviations from block to block
    for (std::size_t k = 0; k < set.lights.size(); ++k) {
        LightSet best = set;
        for (const double factor : {0.25, 0.5, 2.0, 4.0}) {
            LightSet trial = set;
            PolarLight& light = trial.lights[k];
            light.radius_m *= factor;
            if (light.radius_m > kMaxRadiusPerDistance * light.distance_m) continue;
            trial.score =
                fit.score(columns_of(fit, trial.lights, options.disc_samples, options.stride),
                          options.stride, kLuminance);
            if (trial.score.cost < best.score.cost &&
                evidence_over(fit, trial, set) >= kRadiusEvidence)
                best = std::move(trial);
        }
        set = std::move(best);
    }
    return set;
}

/// Refined again from where it ended until that gains no more: one simplex stalls, a fresh one goes
/// on.
LightSet settled(const LightFit& fit, const LightSet& start, RefineOptions options) {
    LightSet set = with_likely_radii(fit, start, options);
    options.keep_distances = has_distant(fit, set);
    const bool is_moved = set.score.cost < start.score.cost;
    // One lamp's four unknowns settle at once; two lamps have ten.
    const int restarts = set.lights.size() > 1 ? kRestarts : is_moved ? 1 : 0;
    for (int again = 0; again < restarts; ++again) {
        const LightSet next = refine_lights(fit, set, options);
        const bool has_settled = next.score.cost > kSettled * set.score.cost;
        if (next.score.cost < set.score.cost) set = next;
        if (has_settled) break;
    }
    return set;
}

/// Whether the last light is strong enough and apart enough to be one of its own.
bool is_light_of_its_own(const LightSet& set) {
    double total = 0.0, least = 1e30;
    for (const PolarLight& light : set.lights) {
        const double e = light.weight / (light.distance_m * light.distance_m);
        total += e;
        least = std::min(least, e);
    }
    const PolarLight& last = set.lights.back();
    return least >= kMinSecondShare * total &&
           std::all_of(set.lights.begin(), set.lights.end() - 1, [&](const PolarLight& light) {
               return angle_between(light.direction, last.direction) > kMinSeparationRad;
           });
}

/// Share of the cost of `worse` that `better` saves.
double gain_of(const LightSet& better, const LightSet& worse) {
    return (worse.score.cost - better.score.cost) / (worse.score.cost + kModelCost);
}

/// Of `finalists`, best first, one elsewhere that the scan hardly tells from the best.
std::string rival_of(const LightFit& fit, const std::vector<LightSet>& finalists) {
    for (std::size_t i = 1; i < finalists.size(); ++i) {
        if (is_same_place(finalists[i], finalists[0], kBasinRad)) continue;
        const double gain = gain_of(finalists[0], finalists[i]);
        const double evidence = evidence_over(fit, finalists[0], finalists[i]);
        log_debug("lights: a rival, cost {:.4f}, {:.2f} deviations worse", finalists[i].score.cost,
                  evidence);
        if (gain < kDoubtfulGain && evidence < kDoubtfulEvidence)
            return fmt::format(
                "the light from {:.0f} degrees further round explains the scan about as well",
                degrees(angle_between(finalists[0].lights[0].direction,
                                      finalists[i].lights[0].direction)));
    }
    return {};
}

}  // namespace

FoundLights find_lights(const LightFit& fit, const LightOptions& options,
                        const Progress& progress) {
    FoundLights found;
    const LightSet coarse =
        search_single(fit, make_hemisphere(fit.samples(), options.candidate_count), kScoutStride)
            .front();
    found.grid_cost = coarse.score.cost;
    found.grid_direction = coarse.lights[0].direction;
    progress.update(0.2, "refining the light");

    const HemisphereGrid dense =
        make_hemisphere(fit.samples(), kDensePerCandidate * options.candidate_count);
    const std::vector<LightSet> singles = search_single(fit, dense, kScoutStride);
    const std::vector<LightSet> ends =
        refined(fit, distinct(singles, kStartSeparationRad, kStarts), scout(70));
    std::vector<LightSet> finalists =
        refined(fit, distinct(ends, kBasinRad, kFinalists), fine(140));
    finalists.front() = settled(fit, finalists.front(), fine(140));
    found.set = finalists.front();
    found.rival = rival_of(fit, finalists);
    progress.update(0.5, "looking for a second light");

    for (int count = 2; count <= options.max_lights; ++count) {
        std::vector<LightSet> firsts = finalists;
        if (count == 2)
            firsts.insert(firsts.end(), singles.begin(),
                          singles.begin() + static_cast<long>(std::min(kFirsts, singles.size())));
        const std::vector<LightSet> starts = distinct(
            search_pairs(fit, dense, firsts, kScoutStride), kStartSeparationRad, kPairStarts);
        if (starts.empty()) break;
        finalists =
            refined(fit, distinct(refined(fit, starts, scout(150)), kBasinRad, 2), fine(260));
        finalists.front() = settled(fit, finalists.front(), fine(260));
        const LightSet& more = finalists.front();
        const double gain = gain_of(more, found.set);
        const double evidence = evidence_over(fit, more, found.set);
        log_debug("lights: {} cost {:.4f}, {} cost {:.4f}, {:.2f} deviations better", count - 1,
                  found.set.score.cost, count, more.score.cost, evidence);
        const bool is_better = gain >= kSecondLightGain && evidence >= kSecondLightEvidence;
        if (is_better && is_light_of_its_own(more)) {
            found.set = more;
            found.rival = rival_of(fit, finalists);
            continue;
        }
        if (gain >= kDoubtfulGain && evidence >= kDoubtfulEvidence)
            found.rival = "another light, weak or close to the one found, may be there as well";
        break;
    }
    return found;
}

}  // namespace vitrine
