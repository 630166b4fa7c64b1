// estimate/model_error.h: what resampling does not see. Bootstraps over views and patches know
// noise and texture; they share the errors of the hull, the mesh, the light and the model itself.
// These terms are added in squares. All were set after looking at 37 worlds (seeds 0 to 36) of
// benchmarks/quality/estimation_worlds: other seeds must check them. No capture was looked at.
#pragma once

#include "estimate/specular.h"
#include "estimate/transparent.h"

namespace vitrine {

// Lights: direction per axis; distance, disc radius and intensity relative.
constexpr double kModelDirectionRad = 0.013;
constexpr double kModelLogDistance = 0.05;
constexpr double kModelLogRadius = 0.27;
constexpr double kModelLogIntensity = 0.10;
// Of several lamps each may stand nearer and weaker while another makes up for it.
constexpr double kSeveralLamps = 2.5;  // times the terms of distance and intensity

// Index: grows with the residual, which is large where the hull is off.
constexpr double kModelIorPerCost = 0.25;
constexpr double kModelAbsorption = 0.30;  // per metre: gain errors of 2 % over 7 cm
constexpr double kModelAbsorptionRatio = 0.05;

// Ward: relative; a hull's normals move light between lobe and diffuse.
constexpr double kModelLogSigma = 0.04;
constexpr double kModelRhoD = 0.0015;  // absolute: next to a lobe little is left for diffuse light
constexpr double kModelLogRhoD = 0.02;
constexpr double kModelLogRhoS = 0.10;

void add_model_error(TransparentFit& solid, const TransparentOptions& options);
void add_model_error(WardFit& fit);

}  // namespace vitrine
