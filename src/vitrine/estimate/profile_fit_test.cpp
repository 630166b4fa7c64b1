#include "estimate/bssrdf.h"
#include "estimate/translucent_world.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

constexpr double kEta = 1.3;

/// Christensen and Burley 2015: what random walks in a half-space leave behind.
RadialProfile random_walks(const Rgbd& albedo, const Rgbd& mean_radius) {
    RadialProfile profile;
    for (int i = 0; i < 300; ++i) {
        const double r = 0.02 * std::pow(500 / 0.02, i / 299.0);
        const Rgbd l = mean_radius / 2.5;
        profile.r.push_back(r);
        profile.rd.push_back(albedo * ((-r / l).exp() + (-r / (3 * l)).exp()) / (8 * kPi * l * r));
    }
    return profile;
}

double worst_ks(const MediumEstimate& medium, const RadialProfile& truth) {
    double worst = 0;
    for (int c = 0; c < 3; ++c)
        worst = std::max(worst, profile_ks_distance(medium.profile(), truth, c, 3, 300));
    return worst;
}

BssrdfOptions known(bool prefers_random_walk) {
    BssrdfOptions options;
    options.is_level_known = true;
    options.prefers_random_walk = prefers_random_walk;
    return options;
}

TEST(ProfileFit, RandomWalksStandUnderALampAside) {
    const Relief relief = testing_world::ellipsoid(220, 100, 80);
    ViewLights lights = testing_world::key_and_back(relief, kEta);
    const RadialProfile truth = random_walks({0.8, 0.65, 0.45}, {12, 10, 8});
    const ImageRgb picture =
        TranslucentRelief(relief).render(irradiance_from_lights(relief, lights, kEta), truth);
    lights.lights[0].direction = (lights.lights[0].direction + Vec3(0.05, 0, 0)).normalized();
    const auto ks = [&](bool prefers) {
        return worst_ks(estimate_bssrdf(picture, relief, Mask(), lights, known(prefers)), truth);
    };
    const double walk = ks(true), free = ks(false);
    EXPECT_LT(walk, 0.06);
    EXPECT_LT(walk, 0.5 * free);
}

TEST(ProfileFit, AnotherProfileRefutesRandomWalks) {
    const Relief relief = testing_world::ellipsoid(220, 100, 80);
    const ViewLights lights = testing_world::key_and_back(relief, kEta);
    const double near = 0.6 / (2 * kPi * 9), far = 0.2 / (2 * kPi * 900);
    const TwoExponentials fit{near, -1 / 3.0, far, -1 / 30.0};
    const RadialProfile truth = tabulate({fit, fit, fit}, 0.03, 480);
    const ImageRgb picture =
        TranslucentRelief(relief).render(irradiance_from_lights(relief, lights, kEta), truth);
    const MediumEstimate medium = estimate_bssrdf(picture, relief, Mask(), lights, known(true));
    EXPECT_LT(worst_ks(medium, truth), 0.1);
    EXPECT_NEAR(medium.fit[1].mean_radius(), fit.mean_radius(), 0.15 * fit.mean_radius());
}

}  // namespace
}  // namespace vitrine
