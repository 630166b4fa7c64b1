// reconstruct/fusion.h: depth maps to one surface through a truncated signed distance volume.
#pragma once

#include "capture/capture.h"
#include "geometry/mesh.h"

#include <span>

namespace vitrine {

struct FusionOptions {
    double voxel_m = 0.003;
    double truncation_m = 0.012;
    double max_depth_m = 2.0;
};

/// Fuses planar depth (0 = invalid) seen by `cameras` (Curless and Levoy 1996; Open3D's scalable
/// volume: memory grows with the surface, not with the number of frames). Frames enter in order, so
/// the result does not depend on threads. No normals, no colours. Cost: about 0.1 s a 640x360
/// frame.
Mesh fuse_depth(std::span<const ImageF> depth_m, std::span<const Camera> cameras,
                const FusionOptions& options);

/// Drops connected pieces smaller than `min_area_m2`.
Mesh without_small_pieces(const Mesh& mesh, double min_area_m2);

}  // namespace vitrine
