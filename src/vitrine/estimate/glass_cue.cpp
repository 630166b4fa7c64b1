#include "estimate/glass_cue.h"

#include "estimate/model_error.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vitrine {

namespace {

// One evaluation in some dozens: fewer photons and places than where the index is searched.
constexpr CausticCueOptions kOptions = {
    .photon_count = 10'000, .pixel_step = 3, .max_receivers = 1500, .block_size_m = 0.05};
constexpr std::size_t kMinReceivers = 150;

double square(double x) { return x * x; }

std::array<double, 5> spread_of(double low, double high) {
    std::array<double, 5> iors;
    for (std::size_t k = 0; k < iors.size(); ++k)
        iors[k] = low + (high - low) * static_cast<double>(k) / (iors.size() - 1.0);
    return iors;
}

}  // namespace

GlassCue::GlassCue(const EstimationScene& scene, const FrameLookup& lookup, int object,
                   const CausticScene& light, const Estimate<double>& through, double ior_min,
                   double ior_max)
    : through_(through),
      ior_min_(ior_min),
      ior_max_(ior_max),
      places_(scene, lookup, object, light, spread_of(ior_min, ior_max), kOptions),
      patches_(places_.patch_count()) {}

bool GlassCue::is_usable() const { return places_.size() >= kMinReceivers; }

double GlassCue::caustic_cost(const std::vector<DiscLight>& lamps, double caustic_ior) const {
    return places_.cost(lamps, caustic_ior);
}

double GlassCue::operator()(const std::vector<DiscLight>& lamps, double caustic_ior) const {
    double nll = 0.5 * patches_ * std::log(std::max(caustic_cost(lamps, caustic_ior), 1e-6));
    if (through_.outcome == Outcome::Converged)
        nll += 0.5 * square(caustic_ior - through_.value) /
               (square(kCausticIor) + square(through_.stddev));
    return nll;
}

double GlassCue::ior(double caustic_ior) const {
    if (through_.outcome != Outcome::Converged) return caustic_ior;
    const double share = square(through_.stddev) / (square(through_.stddev) + square(kCausticIor));
    return through_.value + share * (caustic_ior - through_.value);
}

}  // namespace vitrine
