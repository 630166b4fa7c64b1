// image/poisson.h: Poisson's equation on the pixels of a mask, and what is made of it: smooth
// filling of holes and inflation of silhouettes.
#pragma once

#include "image/image.h"

namespace vitrine {

enum class PoissonBorder {
    Zero,     ///< u = 0 just beyond the picture
    Neumann,  ///< no flow through the picture's border
};

struct PoissonOptions {
    PoissonBorder border = PoissonBorder::Neumann;
    double tolerance = 1e-5;   ///< residual relative to that of u = 0 inside
    int max_iterations = 300;  ///< of conjugate gradients, per level
};

/// Solves -Laplace(u) = `source` (5-point, unit spacing) where `unknown` is inside; u is `known`
/// elsewhere and is returned unchanged there.
///
/// Cascade of conjugate gradients from a coarse grid to the full one (Bornemann and Deuflhard
/// 1996). About 0.2 s per megapixel of unknowns. Same bits for any thread count.
ImageF solve_poisson(const Mask& unknown, const ImageF& known, const ImageF& source,
                     const PoissonOptions& options = {});

/// Fills the inside of `hole` per channel with the harmonic function that meets its surroundings.
ImageRgb harmonic_fill(const ImageRgb& image, const Mask& hole);

/// Solution of Laplace(u) = -1 inside, 0 on the contour (half a pixel outside the last pixel
/// centre, beyond the picture too). sqrt(u / max u) is a half ellipsoid over an elliptic mask.
ImageF inflate(const Mask& mask);

/// Copies to every pixel outside `mask` the value of the nearest inside pixel.
ImageRgb extend_nearest(const ImageRgb& image, const Mask& mask);
ImageF extend_nearest(const ImageF& image, const Mask& mask);

}  // namespace vitrine
