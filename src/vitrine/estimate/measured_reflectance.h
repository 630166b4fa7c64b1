// estimate/measured_reflectance.h: a Ward lobe for reflectances measured with a goniometer.
#pragma once

#include "estimate/estimate.h"
#include "math/vector.h"

#include <filesystem>
#include <vector>

namespace vitrine {

/// One measurement: directions local (z = normal), away from the surface.
struct ReflectanceSample {
    Vec3 to_light = Vec3(0, 0, 1);
    Vec3 to_viewer = Vec3(0, 0, 1);
    double value = 0.0;  ///< BRDF, 1/sr
};

/// Reads one wavelength of a Cornell .brdf file: rows of theta_i phi_i theta_s phi_s (radians, phi
/// apart by pi at the mirror) and one value per wavelength of its header.
/// @throws InputError when the file is none or lacks the wavelength
std::vector<ReflectanceSample> read_cornell_brdf(const std::filesystem::path& path,
                                                 int wavelength_nm);

struct ReflectanceFitOptions {
    /// Steeper directions are left out: Ward has no Fresnel rise, gloss paint has, and the beam's
    /// footprint leaves the sample there.
    double max_angle_deg = 65.0;
    bool is_duer = false;
};

struct MeasuredWard {
    Estimate<double> sigma;
    double rho_d = 0.0, rho_s = 0.0;
    int sample_count = 0;       ///< used
    double residual_rms = 0.0;  ///< of ln(value / model)
};

/// Least squares of ln value: measurement errors are in proportion to the value, and four decades
/// lie between lobe and base. Not identifiable when no sample lies within the lobe.
MeasuredWard fit_measured_ward(const std::vector<ReflectanceSample>& samples,
                               const ReflectanceFitOptions& options = {});

/// What the fit says for these directions, 1/sr.
double ward_value(const MeasuredWard& fit, const ReflectanceSample& sample,
                  const ReflectanceFitOptions& options = {});

}  // namespace vitrine
