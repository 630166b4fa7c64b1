// perception/computational_observer.h: a guess of lambda(n) from the pictures alone, without
// people. It is no measurement and is labelled so wherever it appears.
//
// Two pictures count as just different when the lightness CIE L* of their slightly blurred versions
// differs by one unit in one pixel of a hundred.
#pragma once

#include "image/image.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace vitrine {

struct ComputationalObserverOptions {
    double blur_sigma_px = 1.0;  ///< the eye's own blur, at about 50 pixels per degree
    double quantile = 0.99;      ///< of |Delta L*| over the pixels compared
    double delta_l = 1.0;        ///< about one just noticeable difference of lightness
};

/// The `quantile` of |Delta L*| of two pictures over the pixels that are clipped in neither.
/// @param a, b linear, exposed so that 1 is the display's white
double visible_difference(const ImageRgb& a, const ImageRgb& b,
                          const ComputationalObserverOptions& options = {});

struct PredictedThreshold {
    std::vector<std::array<double, 2>> local;  ///< (n, lambda at n) at each stimulus; infinite
                                               ///< where the series never differs visibly
    double value = 0;                          ///< the smallest of them
};

/// For each stimulus the distance at which the visible difference to the others crosses `delta_l`,
/// interpolated linearly between the stimuli (a difference of 0 at distance 0), the nearer side
/// taken. A series with steps far above lambda only bounds it: the first step is then a straight
/// guess. Cost: one blurred copy per picture and a quantile per pair.
/// @throws InputError when sizes differ or there are fewer than two pictures.
PredictedThreshold predict_thresholds(std::span<const ImageRgb> pictures,
                                      std::span<const double> ior,
                                      const ComputationalObserverOptions& options = {});

/// "vitrine.mlds_prediction/1", which no estimator accepts for a measured scale.
std::string prediction_to_json(const PredictedThreshold& prediction,
                               const ComputationalObserverOptions& options);
PredictedThreshold prediction_from_json(const std::string& text, const std::string& name);

}  // namespace vitrine
