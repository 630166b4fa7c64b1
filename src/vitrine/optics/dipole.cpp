#include "optics/dipole.h"

#include "base/error.h"
#include "math/vector.h"
#include "optics/fresnel.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

double DipoleMedium::sigma_tr() const { return std::sqrt(3.0 * sigma_a * sigma_t_prime()); }

double dipole_boundary(double eta) {
    const double f_dr = diffuse_fresnel_reflectance(eta);
    return (1.0 + f_dr) / (1.0 - f_dr);
}

double dipole_reflectance(const DipoleMedium& medium, double r) {
    // z_r, z_v: depth of the real and height of the virtual source; d_r, d_v: distances to them.
    const double sigma_tr = medium.sigma_tr();
    const double z_r = 1.0 / medium.sigma_t_prime();
    const double z_v = z_r * (1.0 + 4.0 / 3.0 * dipole_boundary(medium.eta));
    const double d_r = std::sqrt(r * r + z_r * z_r);
    const double d_v = std::sqrt(r * r + z_v * z_v);
    const auto source = [&](double z, double d) {
        return z * (sigma_tr * d + 1.0) * std::exp(-sigma_tr * d) / (d * d * d);
    };
    return medium.albedo_prime() / (4.0 * kPi) * (source(z_r, d_r) + source(z_v, d_v));
}

double dipole_total(double albedo_prime, double eta) {
    const double root = std::sqrt(3.0 * (1.0 - albedo_prime));
    return albedo_prime / 2.0 * (1.0 + std::exp(-4.0 / 3.0 * dipole_boundary(eta) * root)) *
           std::exp(-root);
}

double dipole_albedo_prime(double total, double eta) {
    double low = 0.0, high = 1.0;
    for (int i = 0; i < 80; ++i) {
        const double middle = 0.5 * (low + high);
        (dipole_total(middle, eta) < total ? low : high) = middle;
    }
    return low;
}

double dipole_mean_radius(const DipoleMedium& medium) {
    // int r^2 R_d dr / int r R_d dr with r = e^t (trapezium: exponentially accurate).
    const double shortest = 1e-4 / medium.sigma_t_prime();
    const double longest =
        60.0 * std::max(1.0 / medium.sigma_t_prime(), 1.0 / std::max(medium.sigma_tr(), 1e-12));
    const int count = 600;
    const double step = std::log(longest / shortest) / count;
    double zeroth = 0.0, first = 0.0;
    for (int i = 0; i <= count; ++i) {
        const double r = shortest * std::exp(i * step);
        const double weight = dipole_reflectance(medium, r) * r * r;  // r dr = r^2 dt
        zeroth += weight;
        first += weight * r;
    }
    return first / zeroth;
}

DipoleMedium dipole_from_total_and_mean_radius(double total, double mean_radius, double eta) {
    VITRINE_CHECK_GT(mean_radius, 0.0);
    const double albedo = dipole_albedo_prime(std::clamp(total, 1e-6, kDipoleMaxTotal), eta);
    // Lengths scale with 1 / sigma_t', so one evaluation at sigma_t' = 1 settles it.
    DipoleMedium medium{albedo, 1.0 - albedo, eta};
    const double scale = dipole_mean_radius(medium) / mean_radius;
    medium.sigma_s_prime *= scale;
    medium.sigma_a *= scale;
    return medium;
}

}  // namespace vitrine
