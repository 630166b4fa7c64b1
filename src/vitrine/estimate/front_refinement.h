// estimate/front_refinement.h: the front of a translucent body, from its picture and a full
// rendering of it.
#pragma once

#include "estimate/relief_refinement.h"
#include "image/image.h"

#include <functional>

namespace vitrine {

struct FrontRefinementOptions {
    int rounds = 6;        ///< each with one rendering; 0: the front stays
    double bending = 1;    ///< of ReliefRefinementOptions: finer than for a first guess
    double smooth = 0.02;  ///< of what the rendering misses, in inradii
};

/// The picture of a relief as the whole model makes it, in the photograph's units.
using ReliefRenderer = std::function<ImageRgb(const Relief&)>;

struct RefinedFront {
    Relief relief;
    ImageRgb rendered;  ///< of that relief
};

/// A front whose rendering shows what the photograph shows. refine_relief knows scattering as a
/// blur alone; what the full rendering then misses is put on top of the shading that it is asked
/// for (defect correction, Stetter 1978), round by round while the misfit falls by 1 %. The back
/// stays as far behind. Without lamps nothing changes. For one body, not a cluster. It fits the
/// picture better than it finds the shape: on a wrong shape's lamps normals hardly change.
/// @param start its thickness is kept
/// @param dome where refine_relief starts: the silhouette inflated
/// @param excluded highlights
RefinedFront refine_front(const Relief& start, const Relief& dome, const ImageRgb& diffuse,
                          const Mask& excluded, const ViewLights& lights, double kernel_px,
                          double eta, const ReliefRenderer& render,
                          const FrontRefinementOptions& options = {});

}  // namespace vitrine
