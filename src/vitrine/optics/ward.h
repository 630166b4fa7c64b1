// optics/ward.h: the Ward lobe (Ward 1992) with either normalisation.
//
// Printed with sin(theta_o) in the differential-rendering paper (Eq. 9 and 11): a misprint, the
// lobe would diverge along the normal. Here sqrt(cos_i cos_o), or Duer's cos_i cos_o.
#pragma once

#include "math/vector.h"

namespace vitrine {

/// Isotropic specular lobe per unit rho_s, in 1/sr. Directions local (z = normal), away from the
/// surface; 0 below the horizon. Cosines are clamped at kWardMinCos against the pole at grazing.
/// @param is_duer Duer 2006: 1 / (cos_i cos_o) in place of 1 / sqrt(cos_i cos_o)
double ward_lobe(const Vec3& wo, const Vec3& wi, double sigma, bool is_duer = false);
double ward_lobe(const Vec3& wo, const Vec3& wi, double sigma_x, double sigma_y, bool is_duer);

constexpr double kWardMinCos = 0.02;  // below it both forms grow without bound while light vanishes

}  // namespace vitrine
