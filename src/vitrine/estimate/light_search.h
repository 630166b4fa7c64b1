// estimate/light_search.h: from 36 candidates on a hemisphere to continuous lights. Internal to
// estimate/lights.
#pragma once

#include "base/progress.h"
#include "estimate/light_fit.h"

#include <span>
#include <vector>

namespace vitrine {

/// A light as seen from the reference point, aimed at it.
struct PolarLight {
    Vec3 direction = Vec3(0, 0, 1);  ///< unit, toward the light
    double distance_m = 1.0;
    double radius_m = 0.04;
    double weight = 1.0;  ///< relative intensity; the first light has 1
};

struct LightSet {
    std::vector<PolarLight> lights;
    LightScore score;
};

struct HemisphereGrid {
    std::vector<Vec3> directions;
    std::vector<double> distances_m;
};
/// `count` nearly even directions above the plane; distances around the scene's diameter.
HemisphereGrid make_hemisphere(const ScanSamples& samples, int count);

/// Turned by two angles about axes across it, up to the second order.
Vec3 tilted(const Vec3& direction, double x, double y);
TrialLight to_trial(const PolarLight& light, const Vec3& reference_point_m);
LightColumns columns_of(const LightFit& fit, std::span<const PolarLight> lights, int disc_samples,
                        int stride);

void sort_by_cost(std::vector<LightSet>& sets);  ///< best first

/// Scores every grid light alone; best first.
std::vector<LightSet> search_single(const LightFit& fit, const HemisphereGrid& grid, int stride);

/// Scores the grid as a second light beside each of `firsts`; best first.
std::vector<LightSet> search_pairs(const LightFit& fit, const HemisphereGrid& grid,
                                   std::span<const LightSet> firsts, int stride);

/// Whether it lies as near or as low as lights are looked for.
bool is_at_bound(const LightFit& fit, const PolarLight& light);
/// Whether one stands beyond where distances are told apart.
bool has_distant(const LightFit& fit, const LightSet& set);
/// The set refined with light `k` first put at a distance, in radii of the scene, with the same
/// penumbrae; a distant light stays as far.
LightSet at_distance(const LightFit& fit, const LightSet& set, std::size_t k, double per_radius);
/// How clearly one set explains the scan better than another: the difference of the losses over its
/// deviation, from sums over blocks. Below 2: not at all. Where few blocks tell them apart (a
/// shadow or two) it stays small: at most the root of their number.
double evidence_over(const LightFit& fit, const LightSet& better, const LightSet& worse);

struct RefineOptions {
    int stride = 1;
    int disc_samples = 16;
    int max_evaluations = 120;
    double step_rad = 0.1;  ///< first simplex
    bool refine_radius = true;
    bool keep_geometry = false;  ///< only weights
    bool keep_distances = false;
};
/// Simplex search over direction, log distance, log radius and weight of all lights together.
LightSet refine_lights(const LightFit& fit, const LightSet& start, const RefineOptions& options);

}  // namespace vitrine
