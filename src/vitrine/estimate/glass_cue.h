// estimate/glass_cue.h: what one solid clear object says of the lamps and of its index. Internal to
// estimate/joint_light.
#pragma once

#include "estimate/caustic_places.h"
#include "estimate/estimate.h"

#include <optional>

namespace vitrine {

/// Its caustic and the view through it as one likelihood. The normals of a hull's lit half shift
/// the index that a caustic asks for, so the caustic has one of its own, tied to the object's by a
/// normal density; the object's is then eliminated in closed form.
class GlassCue {
  public:
    /// @param through index of the view through it; known to the user: deviation 0
    GlassCue(const EstimationScene& scene, const FrameLookup& lookup, int object,
             const CausticScene& light, const Estimate<double>& through, double ior_min,
             double ior_max);

    /// Whether its caustic shows well enough on the table.
    bool is_usable() const;
    /// Minus the logarithm of the likelihood, constants left out.
    double operator()(const std::vector<DiscLight>& lamps, double caustic_ior) const;
    double caustic_cost(const std::vector<DiscLight>& lamps, double caustic_ior) const;
    /// The object's own index when the caustic's is known.
    double ior(double caustic_ior) const;
    double ior_min() const { return ior_min_; }
    double ior_max() const { return ior_max_; }

  private:
    Estimate<double> through_;
    double ior_min_, ior_max_;
    CausticPlaces places_;
    double patches_ = 0.0;
};

}  // namespace vitrine
