#include "estimate/ward_bound.h"

#include "base/rng.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// Pixels under one or two lamps, half vectors up to 50 degrees, with `noise` of the bright level.
WardProblem problem_of(double sigma, double noise, int lamps, std::uint64_t seed) {
    Rng rng(seed);
    WardProblem p;
    for (int l = 0; l < lamps; ++l) p.lamp_colour.emplace_back(1.0, 0.9 - 0.3 * l, 0.8);
    p.first_term.push_back(0);
    const double u = 1.0 / (sigma * sigma);
    for (int x = 0; x < 300; ++x) {
        p.diffuse.push_back(Rgbd::Constant(0.2 + 0.8 * rng.next_double()));
        p.held.push_back(Rgbd::Constant(0.05 * rng.next_double()));
        p.weight.push_back(Rgbd::Ones());
        Rgbd lobe = p.held.back();
        for (int l = 0; l < lamps; ++l) {
            const double t = std::pow(std::tan(0.9 * rng.next_double()), 2.0);
            const double g = 0.02 + 0.02 * rng.next_double();
            p.tan2.push_back(t);
            p.lamp.push_back(l);
            p.strength.push_back(g);
            lobe += g * u * std::exp(-t * u) * p.lamp_colour[static_cast<std::size_t>(l)];
        }
        p.first_term.push_back(p.tan2.size());
        p.observed.push_back(0.15 * p.diffuse.back() + 0.3 * lobe +
                             noise * Rgbd(rng.next_double() - 0.5, rng.next_double() - 0.5,
                                          rng.next_double() - 0.5));
    }
    return p;
}

TEST(WardBound, RecoversExactlyWhatWasMade) {
    const WardCertificate c = certify_ward(problem_of(0.12, 0.0, 1, 1));
    EXPECT_NEAR(c.sigma, 0.12, 1e-5);
    EXPECT_NEAR(c.rho_d[0], 0.15, 1e-4);
    EXPECT_NEAR(c.rho_s[2], 0.3, 1e-3);
    EXPECT_LE(c.lower_bound, c.upper_bound);
}

TEST(WardBound, BoundHoldsForEveryRoughnessOfTheInterval) {
    Rng rng(9);
    for (int trial = 0; trial < 40; ++trial) {
        const WardProblem p =
            problem_of(0.04 + 0.3 * rng.next_double(), 0.05, 1 + trial % 2, 100 + trial);
        const double low = 0.02 * std::exp(3.0 * rng.next_double());
        const double high = low * std::exp(rng.next_double());
        const double bound = ward_lower_bound(p, low, high, 20.0);
        for (int k = 0; k <= 20; ++k)
            EXPECT_LE(bound, ward_error(p, low * std::pow(high / low, k / 20.0)) * (1 + 1e-9));
    }
}

TEST(WardBound, MeetsTheErrorAsTheIntervalCloses) {
    const WardProblem p = problem_of(0.1, 0.05, 2, 3);
    const double error = ward_error(p, 0.15);
    EXPECT_NEAR(ward_lower_bound(p, 0.15, 0.15, 20.0), error, 1e-7 * error);
    EXPECT_LT(ward_lower_bound(p, 0.1, 0.2, 20.0), ward_lower_bound(p, 0.14, 0.16, 20.0));
}

TEST(WardBound, EqualsADenseGrid) {
    for (int trial = 0; trial < 4; ++trial) {
        const WardProblem p =
            problem_of(0.05 + 0.06 * trial, 0.04, 1 + trial % 2, static_cast<std::uint64_t>(trial));
        WardBoundOptions options;
        const WardCertificate c = certify_ward(p, options);
        EXPECT_TRUE(c.is_complete);
        EXPECT_LE(c.relative_gap(), options.relative_gap);
        // A dense grid, and a denser one around its best.
        double least = 1e30, at = 0.0, low = options.sigma_min, high = options.sigma_max;
        for (int pass = 0; pass < 2; ++pass) {
            const double ratio = std::pow(high / low, 1.0 / 3000);
            for (int k = 0; k <= 3000; ++k) {
                const double sigma = low * std::pow(ratio, k);
                const double error = ward_error(p, sigma);
                if (error < least) {
                    least = error;
                    at = sigma;
                }
            }
            low = at / ratio;
            high = at * ratio;
        }
        EXPECT_LE(c.upper_bound, least * (1 + 1e-9));
        EXPECT_NEAR(c.upper_bound, least, 1e-6 * least);
        EXPECT_LE(c.lower_bound, least);
    }
}

}  // namespace
}  // namespace vitrine
