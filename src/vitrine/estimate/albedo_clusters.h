// estimate/albedo_clusters.h: patches of one paint on a candidate, by k-means with k chosen.
#pragma once

#include "estimate/object_pixels.h"

#include <vector>

namespace vitrine {

struct AlbedoClusterOptions {
    int max_clusters = 6;
    int cells_across = 16;         ///< edge of a cell: the candidate's extent over this
    double min_share = 0.02;       ///< smaller patches join the nearest paint
    double min_silhouette = 0.65;  ///< one paint with noise, cut in two, reaches 0.55
    double min_distance = 8.0;     ///< CIE76 between paints: less is shading left over
    std::uint64_t seed = 0;
};

struct AlbedoClusters {
    int count = 1;
    std::vector<int> of_pixel;  ///< paint of each pixel, in [0, count)
    std::vector<double> share;  ///< of the surface seen
    std::vector<Vec3f> place;   ///< where the surface was looked at
    std::vector<int> of_place;  ///< its paint there

    int at(const Vec3f& point) const;  ///< paint of the nearest place
};

/// Diffuse albedo of each cell of the surface: the 20th percentile over all views of radiance over
/// irradiance, which highlights do not move; k-means in CIE a, b and half of L for each k, and the
/// k whose silhouette is widest (Rousseeuw 1987), or one paint when none stands apart.
/// @param irradiance at each pixel, W/m2
AlbedoClusters find_albedo_clusters(const std::vector<ObjectPixel>& pixels,
                                    const std::vector<Rgb>& irradiance,
                                    const AlbedoClusterOptions& options = {});

}  // namespace vitrine
