// estimate/highlights.h: the glossy reflections of lamps on an object, taken off the picture.
#pragma once

#include "image/image.h"

#include <vector>

namespace vitrine {

struct HighlightOptions {
    int bins = 128;                ///< of the histogram of encoded luminance
    double bin_sigma = 2.0;        ///< its smoothing, in bins
    double max_share = 0.12;       ///< a larger set is no highlight but a bright object
    double top_hat = 0.15;         ///< rise above the surroundings that makes a local highlight
    double top_hat_radius = 0.22;  ///< of the surroundings, in inradii
};

/// One connected reflection.
struct HighlightBlob {
    std::vector<std::size_t> pixels;  ///< indices into the image
    double weight = 0;                ///< sum of luminance excess
    Vec2 centroid_px = Vec2::Zero();  ///< weighted with the excess
    Rgb colour = Rgb::Ones();         ///< of the lamp, largest channel 1, from unclipped pixels
};

enum class HighlightMethod { Histogram, TopHat, None };

struct Highlights {
    Mask core;          ///< the set H
    Mask grown;         ///< H with its fading surroundings: what no diffuse fit should see
    ImageRgb diffuse;   ///< the picture with the grown set filled from around
    ImageRgb residual;  ///< what was taken off, >= 0; clipped peaks are extrapolated
    std::vector<HighlightBlob> blobs;  ///< heaviest first
    HighlightMethod method = HighlightMethod::None;
    double share = 0;  ///< of the object that is core
};

/// Finds H as in Khan et al. 2006 (first valley of the luminance histogram met from the bright
/// end) together with local top-hats, which matter where no valley separates a bright mode; grows
/// each blob until its luminance stops falling; fills beneath harmonically. An empty set is a
/// normal answer for a matte object.
/// @param saturation_level linear value at which a channel clips; 1e30 when it never does
Highlights find_highlights(const ImageRgb& linear, const Mask& mask, double saturation_level,
                           const HighlightOptions& options = {});

}  // namespace vitrine
