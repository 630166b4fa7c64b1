// optics/fresnel.h: what a smooth interface reflects and where it bends light.
#pragma once

#include "math/vector.h"

#include <algorithm>

namespace vitrine {

/// Unpolarised Fresnel reflectance of a dielectric interface (Fresnel 1823, exact).
/// @param cos_i cosine to the normal on the side the light comes from, in [0, 1]
/// @param eta index of the other side / index of this side; 1 on total internal reflection
/// @param[out] cos_t cosine of the refracted ray, 0 on total internal reflection
template <typename T>
T fresnel_dielectric(T cos_i, T eta, T& cos_t) {
    const T sin2_t = (T(1) - cos_i * cos_i) / (eta * eta);
    if (sin2_t >= T(1)) {
        cos_t = T(0);
        return T(1);
    }
    cos_t = std::sqrt(T(1) - sin2_t);
    const T rs = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    const T rp = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return T(0.5) * (rs * rs + rp * rp);
}
template <typename T>
T fresnel_dielectric(T cos_i, T eta) {
    T cos_t;
    return fresnel_dielectric(cos_i, eta, cos_t);
}

/// Unpolarised transmittance into a medium of index `eta`, for a cosine on the outside; 0 from
/// behind, 1 when eta = 1.
template <typename T>
T fresnel_transmittance(T cos_outside, T eta) {
    if (cos_outside <= T(0)) return T(0);
    if (eta == T(1)) return T(1);
    return T(1) - fresnel_dielectric(std::min(cos_outside, T(1)), eta);
}

/// Mirror direction of `wo` (pointing away) about the unit normal.
inline Vec3f reflect(const Vec3f& wo, const Vec3f& n) { return 2.0f * wo.dot(n) * n - wo; }

/// Direction of the ray refracted at the interface, pointing away on the other side (Snell).
/// @param wo unit, away from the surface, with wo . n > 0
/// @param eta index of the other side / index of wo's side
/// @param cos_t from `fresnel_dielectric`, > 0
inline Vec3f refract(const Vec3f& wo, const Vec3f& n, float eta, float cos_t) {
    return -wo / eta + (wo.dot(n) / eta - cos_t) * n;
}

/// Mean diffuse Fresnel reflectance F_dr inside, polynomial of Egan and Hilgeman 1979.
double diffuse_fresnel_reflectance(double eta);

}  // namespace vitrine
