// optics/dipole.h: diffuse reflectance of a semi-infinite scattering medium, by the dipole of
// diffusion theory. Small pure functions; any length unit, the same throughout.
#pragma once

namespace vitrine {

/// A homogeneous medium below a smooth interface. Coefficients per length.
struct DipoleMedium {
    double sigma_s_prime = 1.0;  ///< reduced scattering, sigma_s (1 - g)
    double sigma_a = 0.01;       ///< absorption
    double eta = 1.3;            ///< inside / outside

    double sigma_t_prime() const { return sigma_s_prime + sigma_a; }
    double albedo_prime() const { return sigma_s_prime / sigma_t_prime(); }
    /// Effective transport coefficient sqrt(3 sigma_a sigma_t').
    double sigma_tr() const;
};

/// A = (1 + F_dr) / (1 - F_dr) of the boundary condition; F_dr of Egan and Hilgeman.
double dipole_boundary(double eta);

/// R_d(r) per area: Jensen, Marschner, Levoy, Hanrahan 2001, Eq. 4. Finite at r = 0.
double dipole_reflectance(const DipoleMedium& medium, double r);

/// Integral of R_d over the plane: Jensen and Buhler 2002, Sec. 2; a function of albedo' alone.
double dipole_total(double albedo_prime, double eta);

/// The albedo' whose total is `total`, by bisection; clamped to [0, 1).
double dipole_albedo_prime(double total, double eta);

/// Mean of r over R_d, by quadrature.
double dipole_mean_radius(const DipoleMedium& medium);

/// The medium with the given total and mean radius. `total` above kDipoleMaxTotal cannot be one.
DipoleMedium dipole_from_total_and_mean_radius(double total, double mean_radius, double eta);

constexpr double kDipoleMaxTotal = 0.95;  // nearer to 1 the mean free path runs away

}  // namespace vitrine
