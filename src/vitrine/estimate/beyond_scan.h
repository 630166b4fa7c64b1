// estimate/beyond_scan.h: how bright it is beyond the scan, as solid glass shows it.
//
// A tenth to a half of the rays through glass end beyond the scan. The ambient light that shading
// tells is a rough guess of what they meet (it trades with the lamps), and what it is off by was
// read as absorption: 20 % of it made 0.5 per metre.
#pragma once

#include "estimate/transparent.h"

#include <optional>

namespace vitrine {

/// Adds `change` of the radiance beyond the scan to every prediction.
void add_beyond(std::vector<ThroughPixel>& through, const Rgb& change);

/// The radiance beyond the scan that together with the absorption it calls for explains the pixels
/// best (least absolute deviations); nothing when fewer than 12 pixels in two views show it, or
/// when it would be more than twice as bright as assumed.
/// @param through predictions that hold `assumed` there
/// @param known_sigma_a the absorption when it is given
std::optional<Rgb> radiance_beyond(const std::vector<ThroughPixel>& through,
                                   const std::vector<ObjectPixel>& pixels, double bright,
                                   const Rgb& assumed, const std::optional<Rgb>& known_sigma_a);

}  // namespace vitrine
