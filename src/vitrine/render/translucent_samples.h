// render/translucent_samples.h: the closed surface of a relief as a coarse set of samples, and the
// light that enters it.
#pragma once

#include "optics/fresnel.h"
#include "scene/relief.h"

#include <vector>

namespace vitrine {

/// Cells of a square lattice over the mask, front and mirrored back. Viewer frame, pixels.
struct ReliefSamples {
    /// Front samples first, then back ones in the same order, then walls where a measured
    /// height jumps from one pixel to the next. Light given per pixel (ReliefIrradiance) does not
    /// reach walls.
    std::vector<Vec3f> position;
    std::vector<Vec3f> normal;       ///< unit
    std::vector<float> area_px2;     ///< of the curved surface in the cell
    std::vector<std::int16_t> ball;  ///< of a cluster: which ball; empty for one body
    std::size_t front_count = 0;
    double step_px = 1;        ///< side of a cell
    Image<std::int32_t> cell;  ///< lattice of front sample numbers, -1 where there is no object
    int origin_x = 0, origin_y = 0;  ///< pixel at the lattice's corner: locked to the object's box
};

/// Surface per projected area is capped at 1 / kMinAreaCos: rim pixels are only partly object.
constexpr float kMinAreaCos = 0.15f;

/// About `per_side` samples on each side; on the balls of a cluster twice that many in all, spread
/// evenly (no lattice then). The back mirrors the front about the silhouette plane
/// (the assumption of the paper): position (x, y, -z), normal (nx, ny, -nz).
ReliefSamples sample_relief(const Relief& relief, int per_side);

/// What a distant light of unit irradiance sends through a surface of normal n.
double entering_irradiance(const Vec3f& normal, const Vec3& direction, double eta);

/// What of the light beneath the surface leaves towards the viewer. Cosines are raised to
/// kMinCosOut: true rims get back by grazing reflection what they lose. Renderer and estimators
/// must agree on it: a difference at the rim reads as another material.
constexpr double kMinCosOut = 0.6;
inline double leaving_transmittance(const Vec3f& normal, double eta) {
    return fresnel_transmittance(std::max<double>(normal.z(), kMinCosOut), eta);
}

/// Share of an even half-space of light about (0, -1, 0) that a surface of normal n faces.
inline float facing_down(const Vec3f& normal) { return 0.5f * (1 - normal.y()); }

/// Irradiance that enters the object per surface area, on the visible side and on the mirrored
/// back. Linear in the lights.
struct ReliefIrradiance {
    ImageRgb front, back;
};
ReliefIrradiance irradiance_from_lights(const Relief& relief, const ViewLights& lights, double eta);

/// Scales the lights so that the brightest visible surface gets irradiance pi (luminance).
/// @returns the factor
double normalise_lights(ViewLights& lights, const Relief& relief, double eta);

}  // namespace vitrine
