// reconstruct/tracking.h: camera poses from the frames alone.
#pragma once

#include "capture/capture.h"

#include <vector>

namespace vitrine {

struct TrackingOptions {
    int max_features = 1200;  ///< per frame, strongest first
    /// Frames; beyond: neighbours in time, every tenth frame, and lost frames with all places.
    int all_pairs_up_to = 40;
    int min_inliers = 15;        ///< of a pair of views, else they are not connected, unless ...
    int min_agreeing = 8;        ///< ... at least so many inliers are
    double min_agreement = 0.4;  ///< so large a share of the matches
    int trials = 2000;           ///< of RANSAC
};

struct Tracking {
    std::vector<Camera>
        cameras;  ///< in the frame of the first tracked one; only tracked ones count
    std::vector<bool> is_tracked;  ///< in the largest group of connected frames
    std::vector<int> inliers;      ///< of the connection that placed the frame
};

/// SIFT features with depth, matched between pairs of views, rigid motions by RANSAC on three
/// points; the frames hang on the tree of the strongest connections (maximum spanning tree), so a
/// weak step is bridged by a better detour. Of long videos only neighbours in time and some marks
/// are compared; frames that are lost then are compared with all places. Frames outside the largest
/// connected group have no pose. Not yet refined: small steps add up to a drift of centimetres,
/// which refine_poses takes out. Deterministic. Works while neighbouring views differ by less than
/// about 30 degrees on a textured scene. Cost: 50 ms a frame, 20 ms a pair of 320x240.
Tracking track_poses(const Capture& capture, const TrackingOptions& options = {},
                     const Progress& progress = {});

}  // namespace vitrine
