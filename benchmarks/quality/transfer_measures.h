// benchmarks/quality/transfer_measures.h: how far a transferred object is from the true picture.
#pragma once

#include "scene/relief.h"

namespace vitrine {

struct ObjectScore {
    double psnr_db = 0;         ///< encoded sRGB, peak 1, object pixels, after one fitted exposure
    double linear_psnr_db = 0;  ///< the same in linear light
    double ssim = 0;            ///< mean over object pixels, encoded luminance, 11 x 11 Gaussian
    double exposure = 1;        ///< the factor fitted
};
ObjectScore score_object(const ImageRgb& picture, const ImageRgb& truth, const Mask& mask);

/// Over the lamps' reflections in the true picture (connected, nearly white), weighted by size.
struct HighlightScore {
    double centroid_px = 0;
    double delta_e = 0;  ///< CIE76 of the mean colours there
};
HighlightScore score_highlight(const ImageRgb& picture, const ImageRgb& truth, const Mask& mask);

double mean_normal_error_deg(const Relief& found, const Relief& truth);

}  // namespace vitrine
