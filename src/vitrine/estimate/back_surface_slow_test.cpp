#include "base/rng.h"
#include "estimate/back_surface.h"
#include "estimate/translucent_world.h"
#include "render/render_object.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

constexpr double kEta = 1.3;
constexpr float kThinPx = 12;
constexpr int kSize = 220;

/// An ellipsoid with its right third worn thin from behind: an ear.
struct Ear {
    Relief whole = testing_world::ellipsoid(kSize, 100, 70);
    Relief worn;
    RadialProfile profile = testing_world::apple(12);

    Ear() {
        ImageF thickness = thickness_of(whole);
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                // From all to little over 20 pixels: a cliff would be no ear.
                const float t = std::clamp((static_cast<float>(x) - 135) / 20, 0.0f, 1.0f);
                const float cap = std::exp((1 - t) * std::log(140.0f) + t * std::log(kThinPx));
                thickness(x, y) = std::min(thickness(x, y), cap);
            }
        }
        worn = with_thickness(whole, thickness);
    }

    ImageRgb picture(const Relief& relief, const ViewLights& lights) const {
        TranslucentRenderOptions fine;
        fine.cells_per_side = 6000;
        fine.eta = kEta;
        ImageRgb image = TranslucentRelief(relief, fine)
                             .render(irradiance_with_shadows(relief, lights, kEta), profile);
        for (std::size_t i = 0; i < image.size(); ++i) {
            Rng rng(stream_key(7, i));
            for (int c = 0; c < 3; ++c) image[i][c] *= 1 + 0.02f * (2 * rng.next_float() - 1);
        }
        return image;
    }

    BodyEstimate estimate(const Relief& true_relief, const ViewLights& lights) const {
        BssrdfOptions bssrdf;
        bssrdf.smoothing = 0.01;
        bssrdf.transmittance = Transmittance::Fresnel;
        const EnteringLight light = [&](const Relief& lit, const SurfacePoints& points,
                                        double eta) {
            return entering_light(lit, points, lights, eta, true);
        };
        return estimate_body(whole, picture(true_relief, lights), Mask(), light, bssrdf);
    }
};

/// Median over a square of pixels.
double thickness_at(const Relief& relief, int x0, int y0) {
    const ImageF thickness = thickness_of(relief);
    std::vector<double> values;
    for (int y = y0 - 8; y <= y0 + 8; ++y)
        for (int x = x0 - 8; x <= x0 + 8; ++x) values.push_back(thickness(x, y));
    std::nth_element(values.begin(), values.begin() + 144, values.end());
    return values[144];
}

TEST(BackSurface, LightFromBehindShowsWhereABodyIsThin) {
    const Ear ear;
    const ViewLights lights = testing_world::key_and_back(ear.whole, kEta);
    const BodyEstimate found = ear.estimate(ear.worn, lights);
    ASSERT_TRUE(found.has_thin_parts);
    // Light fades in thickness like in a fog: a factor is what can be told.
    const double thin = thickness_at(found.relief, 175, 110);
    EXPECT_GT(thin, kThinPx / 2);
    EXPECT_LT(thin, 4 * kThinPx);
    EXPECT_LT(thin, 0.5 * thickness_at(ear.whole, 175, 110));
    EXPECT_GT(thickness_at(found.relief, 70, 110), 0.9 * thickness_at(ear.whole, 70, 110));
    // What it is made of is then found as well as in a thick body; with the mirrored back it is
    // not.
    const EnteringLight light = [&](const Relief& lit, const SurfacePoints& points, double eta) {
        return entering_light(lit, points, lights, eta, true);
    };
    BssrdfOptions options;
    options.smoothing = 0.01;
    options.transmittance = Transmittance::Fresnel;
    const MediumEstimate thick =
        estimate_bssrdf(ear.picture(ear.worn, lights), ear.whole, Mask(), light, options);
    double ks_found = 0, ks_thick = 0;
    for (int c = 0; c < 3; ++c) {
        ks_found = std::max(ks_found,
                            profile_ks_distance(found.medium.profile(), ear.profile, c, 2.0, 200));
        ks_thick =
            std::max(ks_thick, profile_ks_distance(thick.profile(), ear.profile, c, 2.0, 200));
    }
    EXPECT_LT(ks_found, 0.2) << ks_thick;
    EXPECT_LT(ks_found, 0.6 * ks_thick);
}

TEST(BackSurface, AThickBodyStaysThick) {
    const Ear ear;
    const ViewLights lights = testing_world::key_and_back(ear.whole, kEta);
    EXPECT_FALSE(ear.estimate(ear.whole, lights).has_thin_parts);
}

TEST(BackSurface, LightFromTheFrontAloneSaysNothing) {
    const Ear ear;
    ViewLights lights = testing_world::key_and_back(ear.whole, kEta);
    lights.lights.resize(1);
    lights.ambient.setZero();
    normalise_lights(lights, ear.whole, kEta);
    EXPECT_FALSE(ear.estimate(ear.worn, lights).has_thin_parts);
}

TEST(BackSurface, BackNormalsAreThoseOfItsHeights) {
    const Ear ear;
    for (const int x : {60, 110, 145, 150}) {
        const int y = 100;
        const float along_x = 0.5f * (ear.worn.back_px(x + 1, y) - ear.worn.back_px(x - 1, y));
        const float along_y = 0.5f * (ear.worn.back_px(x, y - 1) - ear.worn.back_px(x, y + 1));
        const Vec3f expected = Vec3f(along_x, along_y, -1).normalized();
        EXPECT_LT((ear.worn.back_normal(x, y) - expected).norm(), 0.05f) << x;
    }
}

}  // namespace
}  // namespace vitrine
