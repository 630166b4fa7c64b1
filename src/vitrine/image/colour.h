// image/colour.h: sRGB and linear light, and what the eye makes of a difference.
#pragma once

#include "image/image.h"

namespace vitrine {

float srgb_to_linear(float encoded);  ///< IEC 61966-2-1
float linear_to_srgb(float linear);   ///< clamps to [0, 1]

ImageRgb srgb_to_linear(const ImageRgb8& encoded);
/// Rounds to nearest after encoding linear * scale.
ImageRgb8 linear_to_srgb8(const ImageRgb& linear, float scale = 1.0f);

ImageF luminance_image(const ImageRgb& image);

/// CIE L*a*b* of linear Rec. 709 relative to white = 1 (D65).
Vec3f lab_from_linear(const Rgb& linear);
/// CIE76 colour difference.
float delta_e(const Rgb& a, const Rgb& b);

}  // namespace vitrine
