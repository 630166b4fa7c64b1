// estimate/paper_method.h: the published joint optimisation, for comparison (`--method paper`).
//
// Faithful where the paper is defined; its misprints are corrected as listed in docs/estimation.md.
#pragma once

#include "estimate/grid_lights.h"
#include "estimate/materials.h"

#include <string>
#include <utility>
#include <vector>

namespace vitrine {

struct PaperOptions {
    GridLightOptions lights;
    int local_samples = 8;          ///< g, places tried around each light
    double local_radius_deg = 7.0;  ///< of their ring: covers the cell of one of 36 lights
    int roughness_count = 48;       ///< logarithmic, for the exact search of each combination
    double ior_step = 0.01;         ///< lambda
    double caustic_photon_count = 8e6;
};

struct PaperEstimate {
    std::vector<ObjectEstimate> objects;
    double error_initial = 0.0;  ///< relative squared error of the objects at the first light
    double error_joint = 0.0;    ///< at the best combination
    std::vector<std::pair<std::string, double>> seconds;  ///< by part
};

/// Sections 5.2 to 5.4: the printed class rule; all (g+1)^num combinations of places of the lights,
/// for each the best Ward lobe of every metal (exact search in the roughness) and the best index of
/// every glass on the lambda grid; the combination with the least sum of squared errors wins and
/// moves `light`. Then absorption by Eq. 14. Intensities stay those of the first light.
/// Costs about 20 s per glass and 2 s per metal on two cores for one light.
PaperEstimate estimate_paper(const Scene& scene, std::span<const RgbdFrame> frames,
                             double saturation_level, LightEstimate& light,
                             const std::vector<ObjectOverride>& overrides,
                             const ObjectPixelOptions& pixel_options = {},
                             const PaperOptions& options = {}, const Progress& progress = {});

}  // namespace vitrine
