// estimate/model_error.h: what resampling does not see. Bootstraps over views and patches know
// noise and texture; they share the errors of the hull, the mesh, the light and the model itself.
// These terms are added in squares. All were set with made worlds (which ones:
// docs/estimation.md, "How sure"), never with a capture.
#pragma once

#include "estimate/specular.h"
#include "estimate/transparent.h"

namespace vitrine {

/// Of one lamp.
struct LampError {
    double direction_rad;  ///< of the whole angle
    double log_distance;
    double log_irradiance;  ///< the intensity's beside what follows from the distance
};
// Waves of paint wider than a patch look like a nearer or a further lamp; the known albedo is read
// at one spot. Directions of a single lamp are as good as resampling says.
constexpr LampError kSingleLamp = {0.0, 0.02, 0.02};
// Of the sun only the direction can give way to such waves.
constexpr LampError kSun = {0.012, 0.02, 0.02};
// Of several lamps each may stand a little off while another makes up for it; the weaker one shows
// in little but its own shadows.
constexpr LampError kStrongestLamp = {0.004, 0.02, 0.03};
constexpr LampError kWeakerLamp = {0.012, 0.03, 0.06};
// Penumbrae are about as narrow as what a pixel sees of the table.
constexpr double kModelLogRadius = 0.2;

// Index: what a hull is off by changes the residual of every index by about this share, and so all
// indices with a cost within it are alike; and no index is known better than the constant.
constexpr double kAlikeCost = 1.04;
constexpr double kModelIor = 0.004;
// Normals of a hull's lit half shift the index that its caustic asks for by 0.04 to 0.1.
constexpr double kCausticIor = 0.06;
// Absorption: a share of the residual may be the same in all pixels, and then it is read as
// absorption along the way through the glass, whose length the hull also knows within a share.
constexpr double kModelAbsorption = 0.03;  // per metre
constexpr double kModelAbsorptionRatio = 0.005;
constexpr double kCommonResidual = 0.2;

// Ward: relative. A hull's normals are off by this much, which widens or narrows a lobe by the
// square over its own, and move light between lobe and diffuse.
constexpr double kHullNormal_rad = 0.025;
constexpr double kModelLogSigma = 0.03;
constexpr double kModelRhoDPerRhoS = 0.01;  // what the lobe mirrors is not known better
constexpr double kModelLogRhoD = 0.02;
constexpr double kModelLogRhoS = 0.02;

/// What a fit of solid glass tells of its own model error.
struct SolidDoubt {
    double ior_half_width = 0.0;  ///< of the indices with a cost within `kAlikeCost` of the least
    Rgb absorption_per_ior = Rgb::Zero();  ///< what the index is off by goes on into it
    double length_m = 0.0;                 ///< of the median way through the glass
};
void add_model_error(TransparentFit& solid, const TransparentOptions& options,
                     const SolidDoubt& doubt);
/// @param light_stddev of the irradiance, relative: what is measured is its product with a
///   reflectance
void add_model_error(WardFit& fit, double light_stddev);

}  // namespace vitrine
