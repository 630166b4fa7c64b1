// reconstruct/vote_grid.h: where in space depth goes wrong, by the agreement of many views.
#pragma once

#include "geometry/camera.h"
#include "geometry/plane.h"
#include "geometry/scalar_grid.h"
#include "image/image.h"

#include <span>

namespace vitrine {

struct VoteView {
    const Camera* camera = nullptr;
    const ImageF* measured_m = nullptr;
    const ImageF* model_m = nullptr;  ///< depth of the fused surface in this view
    const Mask* bad = nullptr;        ///< regions of missing or wrong depth
    const Mask* known = nullptr;      ///< pixels that can tell at all
};

/// One connected region of voxels.
struct VoxelCluster {
    Box3 box;                        ///< world
    std::vector<std::size_t> nodes;  ///< of the grid
    double volume_m3 = 0.0;
    double bad_fraction = 0.0;  ///< mean over its voxels
};

struct Votes {
    ScalarGrid fraction;  ///< of the views that can tell, how many see bad depth; -1: too few tell
    std::vector<VoxelCluster> clusters;  ///< by falling volume
};

struct VoteOptions {
    double voxel_m = 0.005;
    double min_bad_fraction = 0.6;
    int min_views = 3;
    double min_volume_m3 = 1e-5;
};

/// Votes in `box` (world) above the support plane, after Ji, Xia, Zhang 2017. A voxel hidden behind
/// a reading that agrees with the surface gets no vote from that view.
/// Cost: about 8 ns a voxel and view.
Votes vote_for_bad_depth(std::span<const VoteView> views, const Box3& box, const Plane& support,
                         const VoteOptions& options);

}  // namespace vitrine
