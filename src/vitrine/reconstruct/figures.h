// reconstruct/figures.h: closed shapes that edges of colour draw on a surface. Clear glass shows
// little else: its rims, its highlights and its foot.
#pragma once

#include "image/image.h"

namespace vitrine {

/// Sizes are in pixels of the picture.
struct FigureOptions {
    double blur_px = 2.0;
    int closing_px = 7;       ///< gaps between edges up to twice as wide are closed
    int opening_px = 12;      ///< lines and bridges up to twice as wide are dropped
    double min_pixels = 900;  ///< smaller figures are dropped
};

/// Regions within `where` that are enclosed by edges clearly stronger than those of the bare
/// surface. On a surface with a strong pattern of its own there is no such edge and no figure.
/// @param bare readings of the surface itself, away from things: says how strong its pattern is
/// Cost: about 0.3 s for 1280x720.
Mask find_figures(const ImageRgb& colour, const Mask& where, const Mask& bare,
                  const FigureOptions& options);

}  // namespace vitrine
