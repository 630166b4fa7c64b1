// render/sample_plan.h: how many paths each pixel gets.
#pragma once

#include "image/image.h"

namespace vitrine {

/// Paths each pixel should have had in the end so that the variance of its mean falls to `target`.
/// The variance is averaged over a few neighbours, since a few samples know their own spread badly,
/// but never below the pixel's own.
/// @param variance of each pixel's mean; @param count paths it rests on; @param target variance
/// @return between `count` and `max_samples`, rounded up to a multiple of `multiple`
Image<int> plan_samples(const ImageF& variance, const Image<int>& count, const ImageF& target,
                        int max_samples, int multiple = 1);

}  // namespace vitrine
