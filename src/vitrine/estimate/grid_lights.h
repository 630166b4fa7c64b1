// estimate/grid_lights.h: lights as the published methods find them: non-negative intensities of a
// hemisphere of point lights, one reflectance for everything.
//
// For comparison (`--method local`, `inverse-photon`, first step of `paper`); what they lack shows
// in docs/estimation.md.
#pragma once

#include "estimate/lights.h"

namespace vitrine {

enum class GridLightModel {
    Local,   ///< I (n.l) / r^2: no shadows, no bounces (the paper's reference [6])
    Photons  ///< photon map of each light, n nearest photons (reference [32])
};

struct GridLightOptions {
    GridLightModel model = GridLightModel::Photons;
    int photon_count = 1'000'000;  ///< of each light, into the half space facing the scene
    int nearest_count = 50;        ///< photons a density is taken from; the paper names no number
    double second_share = 0.3;     ///< of the strongest light: weaker ones are spill of the fit
};

struct GridLightEstimate {
    /// Lights at grid positions, strongest first: radius 1 mm, no ambient light.
    LightEstimate light;
    std::vector<Vec3> positions_m;       ///< of all grid lights
    std::vector<double> intensity;       ///< of all, with f = 1 (paper Eq. 5)
    Vec3 mean_direction = Vec3::Zero();  ///< of all, weighted with their irradiance
};

/// Minimises sum (S - sum_j I_j L_j)^2 over I >= 0 (paper Eq. 7) on the samples of the scan. Lights
/// are local maxima of I at least 25 degrees apart, at most `LightOptions::max_lights`.
/// Strength is scaled as in the default method: by the known albedo, else to mean albedo 0.5.
/// Costs about 10 s with a million photons for each of 36 lights on two cores; 0.5 s local.
GridLightEstimate estimate_grid_lights(const Scene& scene, std::span<const RgbdFrame> frames,
                                       double saturation_level, const LightOptions& options = {},
                                       const GridLightOptions& grid_options = {},
                                       const Progress& progress = {});

}  // namespace vitrine
