// estimate/joint_light.h: light, Ward lobes and indices together: highlights and caustics say where
// a lamp stands.
#pragma once

#include "estimate/materials.h"

#include <span>
#include <vector>

namespace vitrine {

enum class JointMode {
    Separate,         ///< light from shading and shadows alone
    Likelihoods,      ///< plus highlights, each cue with its own likelihood
    HighlightsFirst,  ///< highlights alone move the light (the paper's advice), near where it was
};

struct JointOptions {
    JointMode mode = JointMode::Separate;
    int local_samples = 8;  ///< g, places tried around each light before the continuous search
    double local_radius_deg = 3.0;
    double max_move_deg = 8.0;  ///< from the light of shading and shadows
    int max_evaluations = 90;
};

struct JointReport {
    double moved_deg = 0.0;          ///< of the first light
    double light_cost_before = 0.0;  ///< robust cost of shading and shadows
    double light_cost_after = 0.0;
    double object_cost_before = 0.0;  ///< of the metals, mean
    double object_cost_after = 0.0;
};

/// Moves the lights so that shading, shadows and the highlights of all specular candidates agree:
/// all (g+1)^num combinations through Gram matrices, then a simplex search over directions and
/// distances, rho_d, rho_s and sigma eliminated in each step. The terms are of unlike kinds, so
/// each enters as N/2 ln(cost): the likelihood with its own scale eliminated, N the number of its
/// independent patches (8 cm on the scan, 1 cm on a metal). Strength and ambient are fitted again.
///
/// With likelihoods, clear solids take part as well: their caustics move the lamps, and their
/// indices in `objects` with them.
///
/// Returns `light` unchanged when no candidate is specular or such a solid. Costs about 4 s on two
/// cores.
LightEstimate refine_light_jointly(const Scene& scene, std::span<const RgbdFrame> frames,
                                   double saturation_level, const LightEstimate& light,
                                   const LightOptions& light_options,
                                   const MaterialOptions& material_options,
                                   const JointOptions& options,
                                   std::vector<ObjectEstimate>& objects,
                                   JointReport* report = nullptr);

}  // namespace vitrine
