// reconstruct/tracking.h: camera poses from the frames alone.
#pragma once

#include "capture/capture.h"

#include <vector>

namespace vitrine {

struct TrackingOptions {
    int max_features = 1200;   ///< per frame, strongest first
    int all_pairs_up_to = 40;  ///< frames; beyond, neighbours in time and every tenth frame
    int min_inliers = 15;      ///< of a pair of views, else they are not connected
    int trials = 2000;         ///< of RANSAC
};

struct Tracking {
    std::vector<Camera>
        cameras;  ///< in the frame of the first tracked one; only tracked ones count
    std::vector<bool> is_tracked;  ///< in the largest group of connected frames
    std::vector<int> inliers;      ///< of the connection that placed the frame
};

/// SIFT features with depth, matched between pairs of views, rigid motions by RANSAC on three
/// points; the frames hang on the tree of the strongest connections (maximum spanning tree), so a
/// weak step is bridged by a better detour. Frames outside the largest connected group have no
/// pose. Not yet refined. Deterministic. Works while neighbouring views differ by less than about
/// 30 degrees on a textured scene. Cost: 0.1 s a frame and 0.1 s a pair.
Tracking track_poses(const Capture& capture, const TrackingOptions& options = {},
                     const Progress& progress = {});

}  // namespace vitrine
