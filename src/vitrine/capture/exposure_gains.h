// capture/exposure_gains.h: how much brighter each frame shows the same surfaces than the others.
#pragma once

#include "capture/capture.h"

#include <span>
#include <vector>

namespace vitrine {

struct ExposureGains {
    std::vector<double> gain;  ///< per frame; geometric mean 1; all 1 when not significant
    /// The frames contradict each other in brightness, and one factor a frame explains it.
    bool is_significant = false;
    double disagreement_before = 0.0;  ///< rms of log ratios between pairs of views
    double disagreement_after = 0.0;
    std::size_t pairs = 0;  ///< of views that see enough of the same surface
};

/// Median log ratio of the luminance of the same points for pairs of views (found through depth and
/// poses), then one log gain a frame by robust least squares over all pairs. The median stands
/// poses a centimetre off and highlights. Saturated and very dark pixels have no say.
/// Fewer pairs than frames cannot tell an exposure from a shine: then all gains are 1.
/// @param cameras poses to use, one per frame
/// @param excluded per frame: pixels to leave out; may be empty
/// Cost: about 1 ms a pair of views.
ExposureGains estimate_exposure_gains(const Capture& capture, std::span<const Camera> cameras,
                                      std::span<const Mask> excluded = {});

/// Divides the gains out of the radiance; `RgbdFrame::exposure` says so.
void apply_exposure_gains(std::span<const double> gain, Capture& capture);

}  // namespace vitrine
