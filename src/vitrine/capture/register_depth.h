// capture/register_depth.h: depth of one camera as another would see it.
#pragma once

#include "capture/capture_listing.h"

namespace vitrine {

/// Depth (planar z, metres, 0 = invalid) of `depth_camera` in the pixels of `colour`, a pinhole
/// whose pose does not matter. Lens distortion of the depth camera is taken out.
///
/// Neighbouring readings span triangles (1 / z runs linearly over them), drawn with a depth buffer:
/// what a nearer surface hides from the colour camera stays hidden, however coarse the depth is.
/// Steps of depth are left open, not bridged; the readings beside them reach half a pixel out, so
/// that no background shows through between. Cost: about 30 ns a pixel of either picture.
ImageF register_depth(const ImageF& depth_m, const DepthCamera& depth_camera, const Camera& colour);

}  // namespace vitrine
