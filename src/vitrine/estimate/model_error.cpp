#include "estimate/model_error.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

namespace {

Rgb with_share(const Rgb& stddev, const Rgb& value, double constant, double ratio) {
    Rgb sum;
    for (int c = 0; c < 3; ++c)
        sum[c] = static_cast<float>(std::hypot(stddev[c], constant + ratio * value[c]));
    return sum;
}

}  // namespace

void add_model_error(TransparentFit& solid, const TransparentOptions& options,
                     const SolidDoubt& doubt) {
    const double ior = options.known_ior ? 0.0 : std::hypot(kModelIor, doubt.ior_half_width);
    solid.ior.stddev = std::hypot(solid.ior.stddev, ior);
    if (options.known_sigma_a) return;
    Rgb& stddev = solid.sigma_a_per_m.stddev;
    stddev = with_share(stddev, doubt.absorption_per_ior.abs(), 0.0, ior);
    stddev = with_share(stddev, solid.sigma_a_per_m.value, kModelAbsorption, kModelAbsorptionRatio);
    const double common = kCommonResidual * solid.cost / std::max(doubt.length_m, kMinSolidLength);
    stddev = with_share(stddev, Rgb::Zero(), common, 0.0);
}

void add_model_error(WardFit& fit, double light_stddev) {
    constexpr double kMaxWidening = 0.5;
    const double normals = kHullNormal_rad / std::max(fit.sigma.value, 1e-3);
    fit.sigma.stddev = std::hypot(fit.sigma.stddev, fit.sigma.value * kModelLogSigma,
                                  fit.sigma.value * std::min(kMaxWidening, normals * normals));
    fit.stddev_rho_d = with_share(fit.stddev_rho_d, fit.ward.rho_d, 0.0, kModelLogRhoD);
    fit.stddev_rho_d = with_share(fit.stddev_rho_d, fit.ward.rho_s, 0.0, kModelRhoDPerRhoS);
    fit.stddev_rho_d = with_share(fit.stddev_rho_d, fit.ward.rho_d, 0.0, light_stddev);
    fit.stddev_rho_s =
        with_share(fit.stddev_rho_s, fit.ward.rho_s, 0.0, std::hypot(kModelLogRhoS, light_stddev));
}

}  // namespace vitrine
