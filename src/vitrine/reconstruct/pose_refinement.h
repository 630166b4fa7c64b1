// reconstruct/pose_refinement.h: all camera poses at once, so that the views agree about depth and
// colour. No fused surface in between: a surface fused from wrong poses would defend them.
#pragma once

#include "capture/capture.h"

#include <span>
#include <vector>

namespace vitrine {

struct PoseRefinementOptions {
    std::vector<double> blur_px = {6.0, 3.0, 1.2};  ///< of the colour, coarse to fine
    int steps_per_level = 12;
    int max_partners = 14;  ///< views each view is compared with, nearest first
    int samples_per_frame = 1800;
    double min_gain = 0.02;  ///< the cost must fall by this fraction, else the poses stay
};

struct PoseRefinement {
    std::vector<Camera> cameras;
    bool is_accepted = false;
    double cost_before = 0.0;  ///< mean robust cost per comparison, finest level
    double cost_after = 0.0;
    std::size_t comparisons = 0;
};

/// Gauss-Newton (with Levenberg's damping) over the poses of all frames but the first, which stays.
/// Residuals between pairs of views: point to plane in depth, over the sensor's noise; difference
/// of square-root encoded luminance, as far as the surface is diffuse; both with Tukey weights, so
/// that highlights, glass and wrong depth lose their say. Exposures that differ between the frames
/// are evened out first (capture/exposure_gains.h): a brighter frame is no other texture.
/// @param excluded per frame: pixels to leave out; may be empty
/// Radius of convergence: about 2 cm and 1.5 degrees at 1 m. Cost: 0.1 s a step for 14 views.
PoseRefinement refine_poses(const Capture& capture, const std::vector<Camera>& start,
                            std::span<const Mask> excluded,
                            const PoseRefinementOptions& options = {},
                            const Progress& progress = {});

}  // namespace vitrine
