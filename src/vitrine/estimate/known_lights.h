// estimate/known_lights.h: lights that the user knows. Internal to estimate/lights.
#pragma once

#include "estimate/light_fit.h"
#include "estimate/lights.h"

#include <span>

namespace vitrine {

/// The user's lights as given, whatever the pictures say; only the ambient light is fitted.
/// A directional one stands as a lamp far away and is marked distant.
/// @throws InputError for a spot or an environment
void use_known_lights(LightFit& fit, std::span<const Light> lights, LightEstimate& estimate);

}  // namespace vitrine
