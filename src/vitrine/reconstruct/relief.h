// reconstruct/relief.h: the shape of an object from the shading in one photograph.
#pragma once

#include "scene/relief.h"

namespace vitrine {

struct ReliefOptions {
    double alpha = 0.6;           ///< weight of shading detail, as in the paper
    double sigma_spatial = 0.04;  ///< of the fine bilateral filter, in inradii; larger is smoother
    double depth = 1.0;           ///< depth of the inflated base: 1 = as deep as wide
    double detail_gain = 0.35;    ///< inradii of height per unit of encoded luminance
};

/// Depth and normals of the visible side.
///
/// Base: the silhouette inflated (Laplace(u) = -1, height sqrt(u): half ellipsoids over ellipses).
/// Detail: luminance after Khan, Reinhard, Fleming, Buelthoff 2006, "Image-based material editing"
/// (dark is deep, sigmoid compression, bilateral filters). Normals from the gradient of the
/// squared height, which stays finite at the rim. Give the picture without highlights, or each
/// becomes a bump. Costs about 0.5 s per megapixel of object. Texture is taken for relief.
Relief shade_to_shape(const ImageRgb& diffuse, const Mask& mask, const ReliefOptions& options = {});

/// Normals of a height field given on a mask, by differences of the blurred squared height.
Image<Vec3f> relief_normals(const ImageF& depth_px, const Mask& mask, double sigma_px = 1.0);

}  // namespace vitrine
