#include "optics/fresnel.h"
#include "optics/ward.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(Fresnel, NormalIncidenceBrewsterAndTotalReflection) {
    EXPECT_NEAR(fresnel_dielectric(1.0, 1.5), 0.04, 1e-12);
    const double brewster = std::atan(1.5);
    const double cos_i = std::cos(brewster);
    double cos_t;
    const double f = fresnel_dielectric(cos_i, 1.5, cos_t);
    const double rs = (cos_i - 1.5 * cos_t) / (cos_i + 1.5 * cos_t);
    EXPECT_NEAR(f, 0.5 * rs * rs, 1e-12);  // the p wave vanishes
    EXPECT_EQ(fresnel_dielectric(0.5, 1 / 1.5), 1.0);
    // The same whichever side it is seen from.
    EXPECT_NEAR(fresnel_dielectric(cos_t, 1 / 1.5), f, 1e-12);
}

TEST(Fresnel, RefractionObeysSnell) {
    const Vec3f n(0, 0, 1), wo = Vec3f(0.6f, 0, 0.8f);
    float cos_t;
    fresnel_dielectric(0.8f, 1.5f, cos_t);
    const Vec3f t = refract(wo, n, 1.5f, cos_t);
    EXPECT_NEAR(t.norm(), 1.0f, 1e-6f);
    EXPECT_NEAR(t.x(), -0.4f, 1e-6f);
    EXPECT_LT(t.z(), 0.0f);
    EXPECT_NEAR((reflect(wo, n) - Vec3f(-0.6f, 0, 0.8f)).norm(), 0.0f, 1e-6f);
}

TEST(Ward, ReciprocalAndPeaksAtTheMirrorDirection) {
    const Vec3 wo = Vec3(0.5, 0.1, 0.8).normalized(), wi = Vec3(-0.4, 0.2, 0.9).normalized();
    for (const bool is_duer : {false, true}) {
        EXPECT_NEAR(ward_lobe(wo, wi, 0.2, 0.1, is_duer), ward_lobe(wi, wo, 0.2, 0.1, is_duer),
                    1e-14);
        EXPECT_GT(ward_lobe(wo, Vec3(-wo.x(), -wo.y(), wo.z()), 0.2, is_duer),
                  ward_lobe(wo, wi, 0.2, is_duer));
    }
    EXPECT_EQ(ward_lobe(wo, Vec3(0, 0.6, -0.8), 0.2), 0.0);
}

TEST(Ward, NarrowLobeAlongTheNormalHasUnitAlbedo) {
    // integral of f cos over directions -> rho_s for small sigma near normal incidence.
    const Vec3 wo(0, 0, 1);
    const double sigma = 0.1;
    double sum = 0;
    const int steps = 4000;
    for (int i = 0; i < steps; ++i) {
        const double theta = 0.5 * kPi * (i + 0.5) / steps;
        const Vec3 wi(std::sin(theta), 0, std::cos(theta));
        sum +=
            ward_lobe(wo, wi, sigma, true) * wi.z() * std::sin(theta) * 2 * kPi * 0.5 * kPi / steps;
    }
    EXPECT_NEAR(sum, 1.0, 0.02);
}

}  // namespace
}  // namespace vitrine
