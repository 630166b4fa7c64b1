// render/split_kernel.h: a diffusion profile cut into what coarse samples can hold and what they
// cannot.
#pragma once

#include "optics/radial_profile.h"

namespace vitrine {

/// R_d split at the distance rho into what a lattice can hold and what it cannot.
struct SplitKernel {
    RadialProfile far;  ///< R beyond rho; a Gaussian cap of equal value and slope below
    Rgbd near_share = Rgbd::Zero();  ///< albedo of R - far
    double near_sigma = 0;           ///< its Gaussian width
};

/// @param rho in the profile's length unit; a few sample spacings
SplitKernel split_kernel(const RadialProfile& profile, double rho);

}  // namespace vitrine
