#include "estimate/measured_reflectance.h"

#include "base/error.h"
#include "base/rng.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

namespace vitrine {
namespace {

std::vector<ReflectanceSample> measure(double rho_d, double rho_s, double sigma, double noise,
                                       double max_half_rad = 1.0) {
    MeasuredWard truth;
    truth.rho_d = rho_d;
    truth.rho_s = rho_s;
    truth.sigma.value = sigma;
    Rng rng(4);
    std::vector<ReflectanceSample> samples;
    while (samples.size() < 500) {
        const auto draw = [&] {
            const double t = 1.0 * rng.next_double(), p = 2 * kPi * rng.next_double();
            return Vec3(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t));
        };
        ReflectanceSample s{draw(), draw(), 0.0};
        if (angle_between(s.to_light + s.to_viewer, Vec3(0, 0, 1)) > max_half_rad) continue;
        s.value = ward_value(truth, s) * (1.0 + noise * (rng.next_double() - 0.5));
        samples.push_back(s);
    }
    return samples;
}

TEST(MeasuredReflectance, RecoversExactlyAndWithNoise) {
    const MeasuredWard exact = fit_measured_ward(measure(0.06, 0.08, 0.2, 0.0));
    EXPECT_NEAR(exact.sigma.value, 0.2, 1e-4);
    EXPECT_NEAR(exact.rho_d, 0.06, 1e-4);
    EXPECT_NEAR(exact.rho_s, 0.08, 1e-4);
    EXPECT_EQ(exact.sigma.outcome, Outcome::Converged);
    const MeasuredWard noisy = fit_measured_ward(measure(0.06, 0.08, 0.2, 0.3));
    EXPECT_NEAR(noisy.sigma.value, 0.2, 0.01);
    EXPECT_NEAR(noisy.rho_s, 0.08, 0.008);
}

TEST(MeasuredReflectance, SaysNoWithoutALobe) {
    EXPECT_EQ(fit_measured_ward(measure(0.3, 0.0, 0.2, 0.05)).sigma.outcome,
              Outcome::NotIdentifiable);
    EXPECT_EQ(fit_measured_ward({}).sigma.outcome, Outcome::NotIdentifiable);
}

TEST(MeasuredReflectance, ReadsTheFormat) {
    const std::string path = testing::TempDir() + "/two.brdf";
    std::ofstream(path) << "# paint\n2\n600 610\n0.5 0.0 0.4 3.14159265 0.25 0.3\n"
                           "0.1 0 0.2 0 0.5 0.6\n";
    const std::vector<ReflectanceSample> samples = read_cornell_brdf(path, 610);
    ASSERT_EQ(samples.size(), 2u);
    EXPECT_EQ(samples[0].value, 0.3);
    EXPECT_NEAR(samples[0].to_viewer.x(), -std::sin(0.4), 1e-6);
    EXPECT_THROW(read_cornell_brdf(path, 550), InputError);
    EXPECT_THROW(read_cornell_brdf(path + ".none", 600), InputError);
}

/// Paints of the Cornell measurements against the published fits (docs/estimation.md).
TEST(RealReflectance, PaintsAgreeWithPublishedFits) {
    const char* root = std::getenv("VITRINE_REAL_DATA");
    if (!root) GTEST_SKIP() << "VITRINE_REAL_DATA is not set";
    struct Published {
        const char* file;
        double rho_d, rho_s, sigma;
    };
    for (const Published& p : {Published{"garnet_red", 0.060, 0.084, 0.267},
                               Published{"krylon_blue", 0.009, 0.048, 0.255}}) {
        const MeasuredWard fit = fit_measured_ward(
            read_cornell_brdf(std::string(root) + "/measured_materials/" + p.file + ".brdf", 600));
        EXPECT_NEAR(fit.rho_d, p.rho_d, 0.1 * p.rho_d) << p.file;
        EXPECT_NEAR(fit.rho_s, p.rho_s, 0.1 * p.rho_s) << p.file;
        EXPECT_NEAR(fit.sigma.value, p.sigma, 0.1 * p.sigma) << p.file;
    }
}

}  // namespace
}  // namespace vitrine
