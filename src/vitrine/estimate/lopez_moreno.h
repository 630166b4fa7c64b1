// estimate/lopez_moreno.h: lights from the luminance along and within a contour, as published.
#pragma once

#include "estimate/translucency_lights.h"

namespace vitrine {

struct LopezMorenoOptions {
    int max_lights = 3;
    int azimuth_bins = 72;
    double min_improvement = 0.2;  ///< a further light must lower the contour misfit by this share
    double eta = 1.3;              ///< for the common normalisation only
};

/// Lopez-Moreno, Hadap, Reinhard, Gutierrez 2010, "Compositing images through light source
/// detection": azimuths from the luminance of a band along the contour by a k-means-like
/// assignment; zeniths from the first luminance maximum walking inward from the contour; luminance
/// that only falls inward means a light behind (the shadow-line branch). Assumes a Lambertian
/// object: on translucent ones it misjudges lights from behind. Kept for comparison and for the
/// paper's method.
ViewLightsEstimate estimate_lopez_moreno_lights(const ImageRgb& diffuse, const Relief& relief,
                                                const Mask& excluded,
                                                const LopezMorenoOptions& options = {});

}  // namespace vitrine
