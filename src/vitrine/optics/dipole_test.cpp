#include "optics/dipole.h"

#include "optics/radial_profile.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// Integral of 2 pi r R(r) with r = e^t.
template <typename F>
double plane_integral(const F& f, double shortest, double longest) {
    const int count = 4000;
    const double step = std::log(longest / shortest) / count;
    double sum = kPi * shortest * shortest * f(0.0);
    for (int i = 0; i < count; ++i) {
        const double r = shortest * std::exp((i + 0.5) * step);
        sum += 2 * kPi * r * r * step * f(r);
    }
    return sum;
}

TEST(Dipole, IntegralIsTheClosedForm) {
    // Jensen 2001 in 1/mm: apple, marble, skim milk (red), and a strong absorber.
    const DipoleMedium media[] = {{2.29, 0.0030, 1.3},
                                  {2.19, 0.0021, 1.5},
                                  {0.70, 0.0014, 1.3},
                                  {1.90, 0.0142, 1.3},
                                  {1.0, 1.0, 1.4}};
    for (const DipoleMedium& medium : media) {
        const double sum = plane_integral([&](double r) { return dipole_reflectance(medium, r); },
                                          1e-5, 80 / medium.sigma_tr());
        EXPECT_NEAR(sum / dipole_total(medium.albedo_prime(), medium.eta), 1.0, 2e-6);
    }
}

TEST(Dipole, MediumComesBackFromTotalAndMeanRadius) {
    const DipoleMedium truth{2.39, 0.0034, 1.3};
    const double total = dipole_total(truth.albedo_prime(), truth.eta);
    const DipoleMedium found =
        dipole_from_total_and_mean_radius(total, dipole_mean_radius(truth), truth.eta);
    EXPECT_NEAR(found.sigma_s_prime / truth.sigma_s_prime, 1, 1e-6);
    EXPECT_NEAR(found.sigma_a / truth.sigma_a, 1, 1e-5);
}

TEST(Dipole, TotalGrowsWithAlbedo) {
    double last = -1;
    for (double albedo = 0.05; albedo < 1; albedo += 0.05) {
        EXPECT_GT(dipole_total(albedo, 1.3), last);
        last = dipole_total(albedo, 1.3);
        EXPECT_NEAR(dipole_albedo_prime(last, 1.3), albedo, 1e-10);
    }
}

TEST(TwoExponentials, IntegralsAreExact) {
    const TwoExponentials fit{0.3, -2.0, 0.05, -0.4};
    EXPECT_NEAR(plane_integral(fit, 1e-6, 120), fit.total(), 1e-6);
    EXPECT_NEAR(fit.cumulative(1e3), fit.total(), 1e-12);
    EXPECT_NEAR(fit.cumulative(fit.half_radius()), 0.5 * fit.total(), 1e-9);
    const double first = plane_integral([&](double r) { return r * fit(r); }, 1e-6, 200);
    EXPECT_NEAR(fit.mean_radius(), first / fit.total(), 1e-5);
}

TEST(TwoExponentials, RescalingKeepsTheAlbedo) {
    const TwoExponentials fit{0.3, -2.0, 0.05, -0.4};
    EXPECT_NEAR(fit.scaled(2.5).total(), fit.total(), 1e-12);
    EXPECT_NEAR(fit.scaled(2.5).mean_radius(), 2.5 * fit.mean_radius(), 1e-12);
}

TEST(TwoExponentials, RandomWalksBeyondWhatPicturesResolve) {
    constexpr double kMean = 4, kAlbedo = 0.7, kFrom = 0.15 * kMean;
    const TwoExponentials fit = random_walk_profile(kAlbedo, kMean);
    EXPECT_NEAR(fit.total(), kAlbedo, 1e-12);
    // Christensen and Burley 2015: the share beyond r.
    const auto beyond = [&](double r) {
        return 0.25 * std::exp(-r / (kMean / 2.5)) + 0.75 * std::exp(-r / (3 * kMean / 2.5));
    };
    for (double r = kFrom; r < 20 * kMean; r *= 1.05) {
        const double ours = (kAlbedo - fit.cumulative(r)) / (kAlbedo - fit.cumulative(kFrom));
        EXPECT_NEAR(ours, beyond(r) / beyond(kFrom), 0.01) << r;
    }
}

TEST(RadialProfile, TableFollowsTheFit) {
    const TwoExponentials fit{0.3, -2.0, 0.05, -0.4};
    const RadialProfile table = tabulate({fit, fit, fit}, 0.01, 40);
    EXPECT_NEAR(table.total()[1], fit.total(), 1e-3 * fit.total());
    EXPECT_NEAR(table.cumulative(1.7)[2], fit.cumulative(1.7), 1e-3 * fit.total());
    const std::vector<double> radii = {0, 0.005, 0.3, 0.3, 1.7, 40, 60};
    const std::vector<Rgbd> within = table.cumulative(radii);
    for (std::size_t i = 0; i < radii.size(); ++i)
        EXPECT_NEAR(within[i][0], table.cumulative(radii[i])[0], 1e-12) << radii[i];
    EXPECT_EQ(within.front()[0], 0);
    EXPECT_NEAR(table.at(3.33)[0], fit(3.33), 1e-3 * fit(3.33));
    EXPECT_NEAR(table.scaled(3).total()[0], table.total()[0], 1e-9);
    EXPECT_NEAR(table.mean_radius()[0], fit.mean_radius(), 5e-3 * fit.mean_radius());
}

TEST(RadialProfile, KsDistanceOfAScaledCopy) {
    const TwoExponentials fit{1.0, -1.0, 0.0, -1.0};
    const RadialProfile a = tabulate({fit, fit, fit}, 0.001, 60);
    EXPECT_NEAR(profile_ks_distance(a, a.scaled(1.0), 0, 0.01, 50), 0, 1e-12);
    const RadialProfile b = a.scaled(2.0);
    // By hand: max over r of (1 + r/2) e^{-r/2} - (1 + r) e^{-r}.
    double by_hand = 0;
    for (double r = 0; r < 20; r += 1e-3)
        by_hand = std::max(by_hand, (1 + r / 2) * std::exp(-r / 2) - (1 + r) * std::exp(-r));
    EXPECT_NEAR(profile_ks_distance(a, b, 0, 1e-3, 55), by_hand, 2e-3);
}

}  // namespace
}  // namespace vitrine
