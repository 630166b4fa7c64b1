// reconstruct/mask_regions.h: connected regions of a mask and their shapes.
#pragma once

#include "image/image.h"

#include <vector>

namespace vitrine {

/// A connected region (by sides), as a mask of its own.
struct Region {
    Mask mask;
    double pixels = 0;
    bool touches_border = false;
};

/// Regions of at least `min_pixels`, in reading order. Cost: one pass, and a mask for each region.
std::vector<Region> regions_of(const Mask& mask, double min_pixels);

/// The mask without smaller regions.
Mask without_small_regions(const Mask& mask, double min_pixels);

Mask fill_holes(const Mask& mask);   ///< everything within outer contours
Mask convex_hull(const Mask& mask);  ///< of all pixels inside; empty when they are fewer than 3
Mask mask_and(const Mask& a, const Mask& b);
Mask mask_minus(const Mask& a, const Mask& b);

/// Cuts a region in two between the two deepest dents of its contour; empty when it has no waist.
std::vector<Region> cut_at_waist(const Region& region);

}  // namespace vitrine
