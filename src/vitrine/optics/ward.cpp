#include "optics/ward.h"

namespace vitrine {

double ward_lobe(const Vec3& wo, const Vec3& wi, double sigma_x, double sigma_y, bool is_duer) {
    if (wo.z() <= 0 || wi.z() <= 0) return 0.0;
    const Vec3 h = wo + wi;  // unnormalised: only ratios enter
    const double tan2 =
        (h.x() * h.x() / (sigma_x * sigma_x) + h.y() * h.y() / (sigma_y * sigma_y)) /
        (h.z() * h.z());
    const double product = std::max(wo.z(), kWardMinCos) * std::max(wi.z(), kWardMinCos);
    return std::exp(-tan2) /
           (4 * kPi * sigma_x * sigma_y * (is_duer ? product : std::sqrt(product)));
}

double ward_lobe(const Vec3& wo, const Vec3& wi, double sigma, bool is_duer) {
    return ward_lobe(wo, wi, sigma, sigma, is_duer);
}

}  // namespace vitrine
