// benchmarks/quality/sphere_caustic.h: the caustic of the canonical scene by counting: light of a
// point through an exact sphere, no mesh, no photons' kernel, no chance.
#pragma once

#include "image/image.h"
#include "reference_scene.h"

namespace vitrine {

/// Radiance that the table sends to each pixel of light that went through the ball (up to two
/// reflections within it). Rays of an even grid over the cone around the ball are counted in the
/// pixels whose footprint on the table they meet; what hides the table from the camera is ignored.
/// @param side rays: its square; 6000 take a few seconds and leave about 1 % in bright pixels
ImageF sphere_caustic(const ReferenceScene& reference, const Camera& camera, int side = 6000);

}  // namespace vitrine
