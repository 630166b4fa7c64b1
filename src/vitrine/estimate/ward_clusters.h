// estimate/ward_clusters.h: one Ward lobe for each paint of a candidate (paper Table 1).
#pragma once

#include "estimate/albedo_clusters.h"
#include "estimate/specular.h"

#include <vector>

namespace vitrine {

struct WardCluster {
    double area_fraction = 1.0;
    WardFit fit;
};

struct ClusteredWard {
    WardFit whole;  ///< one lobe for everything
    std::vector<WardCluster> clusters;
    double cost = 1.0, cost_diffuse = 1.0;  ///< of all clusters, weighted with their area
    /// Logarithm of the cost without lobes over that with them, clipped highlights included.
    double lobe_gain = 0.0;
    AlbedoClusters paints;  ///< which cluster lies where; one paint when more do not pay
};

/// Fits the whole, then every paint on its own where enough of it lies in a highlight; elsewhere
/// the lobe of the whole is kept and only the diffuse albedo fitted. Several paints are kept when
/// they lower the robust cost by 15 % for each one added. Costs about 1 s per object, twice that
/// when paints stand apart.
ClusteredWard fit_ward_clusters(const EstimationScene& scene,
                                const std::vector<ObjectPixel>& pixels, const KnownLight& light,
                                double bright, const SpecularOptions& options);

}  // namespace vitrine
