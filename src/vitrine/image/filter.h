// image/filter.h: blurs, masks and distances. Results do not depend on the number of threads.
#pragma once

#include "image/image.h"

namespace vitrine {

/// Separable Gaussian with radius ceil(3 sigma), border replicated.
ImageF gaussian_blur(const ImageF& image, double sigma_px);
ImageRgb gaussian_blur(const ImageRgb& image, double sigma_px);

/// Square structuring element of half-width `radius_px`.
Mask dilate(const Mask& mask, int radius_px);
Mask erode(const Mask& mask, int radius_px);  ///< beyond the border counts as inside

Mask mask_or(const Mask& a, const Mask& b);
Mask mask_not(const Mask& a);
std::size_t count_inside(const Mask& mask);
/// Intersection over union; 1 when both are empty.
double intersection_over_union(const Mask& a, const Mask& b);

/// Euclidean distance in pixels of every pixel centre to the nearest inside pixel (Felzenszwalb and
/// Huttenlocher 2012), exact; infinite (1e9) when the mask is empty.
ImageF distance_to(const Mask& mask);
/// Positive outside, negative inside, zero on the border between pixels.
ImageF signed_distance(const Mask& mask);

/// Half the size: the mean of each 2 x 2 block (last odd row or column dropped).
ImageRgb downsample_half(const ImageRgb& image);

}  // namespace vitrine
