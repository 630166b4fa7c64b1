// estimate/relief_refinement.h: a relief corrected so that known lights explain its shading.
#pragma once

#include "scene/relief.h"

namespace vitrine {

struct ReliefRefinementOptions {
    int rounds = 6;           ///< Gauss-Newton, each with fresh normals
    double work_radius = 36;  ///< inradius, in pixels, at which it runs
    double stiffness = 0.15;  ///< price of slopes that the start did not have
    double bending = 2.0;     ///< price of their change from pixel to pixel
};

/// Shape from shading with known lights: the height correction d that minimises
///   sum w (a . grad d - e)^2 + stiffness |grad d|^2 + bending |grad grad d|^2,  d = 0 on the rim,
/// where e is what the observed shading exceeds the predicted and a its derivative by the slopes;
/// Huber weights keep cast shadows and texture from tearing it. What scattering has softened is
/// compared with a prediction softened alike (`kernel_px`). Replaces "dark is deep" (reconstruct/
/// relief.h) where lights are known. A cluster is returned unchanged. O(pixels).
/// @param excluded highlights
Relief refine_relief(const Relief& start, const ImageRgb& diffuse, const Mask& excluded,
                     const ViewLights& lights, double kernel_px, double eta,
                     const ReliefRefinementOptions& options = {});

}  // namespace vitrine
