#include "base/parallel.h"
#include "base/rng.h"
#include "estimate/ball_heights.h"
#include "estimate/bssrdf.h"
#include "estimate/highlight_light.h"
#include "estimate/highlights.h"
#include "estimate/lopez_moreno.h"
#include "estimate/profile_fit.h"
#include "estimate/relief_refinement.h"
#include "estimate/translucency_lights.h"
#include "estimate/translucent_world.h"
#include "reconstruct/balls.h"
#include "reconstruct/relief.h"
#include "render/render_object.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

using testing_world::apple;
using testing_world::ellipsoid;
using testing_world::key_and_back;
using testing_world::nearest_deg;

struct World {
    Relief relief = ellipsoid(220, 100, 80);
    ViewLights lights = key_and_back(relief, 1.3);
    RadialProfile profile = apple(5);
    ImageRgb diffuse =
        TranslucentRelief(relief).render(irradiance_from_lights(relief, lights, 1.3), profile);

    ImageRgb noisy() const {
        ImageRgb image = diffuse;
        for (std::size_t i = 0; i < image.size(); ++i) {
            Rng rng(stream_key(7, i));
            for (int c = 0; c < 3; ++c) image[i][c] *= 1 + 0.02f * (2 * rng.next_float() - 1);
        }
        return image;
    }
};

TEST(DistanceHistogram, GivesThePictureOfTheRenderer) {
    const World world;
    const ReliefSamples samples = sample_relief(world.relief, 3000);
    const ReliefObservations observations = draw_observations(world.relief, Mask(), 300, 4, 0.5, 3);
    const TwoExponentials fit{2e-3, -0.2, 1e-4, -0.05};
    Eigen::MatrixXf source(static_cast<Eigen::Index>(samples.position.size()), 1);
    for (std::size_t i = 0; i < samples.position.size(); ++i) {
        double e = world.lights.ambient[0];
        for (const ViewLight& light : world.lights.lights) {
            e += light.intensity[0] * entering_irradiance(samples.normal[i], light.direction, 1.3);
        }
        source(static_cast<Eigen::Index>(i), 0) = static_cast<float>(e) * samples.area_px2[i];
    }
    const ReliefIrradiance irradiance = irradiance_from_lights(world.relief, world.lights, 1.3);
    Eigen::MatrixXf local(static_cast<Eigen::Index>(observations.pixel.size()), 1);
    for (std::size_t p = 0; p < observations.pixel.size(); ++p)
        local(static_cast<Eigen::Index>(p), 0) = irradiance.front[observations.pixel[p]][0];
    const DistanceHistogram histogram(observations, samples, source, local,
                                      {curved_body_factor(fit.total())});
    const Eigen::VectorXd image = histogram.image_of(fit).col(0);
    TranslucentRenderOptions options;
    options.eta = 1;  // no loss on the way out: exitance / pi
    const ImageRgb rendered = TranslucentRelief(world.relief, options)
                                  .render(irradiance, tabulate({fit, fit, fit}, 0.02, 400));
    double error = 0;
    for (std::size_t p = 0; p < observations.pixel.size(); ++p) {
        const double exact = rendered[observations.pixel[p]][0] * kPi;
        error += std::abs(image[static_cast<Eigen::Index>(p)] / exact - 1);
    }
    EXPECT_LT(error / static_cast<double>(observations.pixel.size()), 0.006);
}

TEST(Bssrdf, KnownShapeAndLightsGiveTheProfile) {
    const World world;
    BssrdfOptions options;
    options.use_shadows = false;
    options.smoothing = 0.01;
    const MediumEstimate found =
        estimate_bssrdf(world.noisy(), world.relief, Mask(), world.lights, options);
    const Rgbd albedo = world.profile.total();
    for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        EXPECT_NEAR(found.channels[k].albedo / albedo[c], 1, 0.06) << c;
        EXPECT_LT(profile_ks_distance(found.profile(), world.profile, c, 2.0, 250), 0.12) << c;
    }
    EXPECT_TRUE(found.dipole[0].has_value());
    EXPECT_NEAR(found.channels[2].albedo / found.channels[0].albedo / (albedo[2] / albedo[0]), 1,
                0.05);
}

TEST(Bssrdf, TheRimIsLitAsTheRendererLightsIt) {
    // Where renderer and estimator let different shares of light leave, the rim stays unexplained.
    const World world;
    BssrdfOptions options;
    options.use_shadows = false;
    options.smoothing = 0.01;
    options.transmittance = Transmittance::Fresnel;
    const MediumEstimate found =
        estimate_bssrdf(world.diffuse, world.relief, Mask(), world.lights, options);
    for (const ChannelFit& channel : found.channels) EXPECT_LT(channel.relative_residual, 0.022);
}

TEST(Bssrdf, AWiderChannelOfEqualAlbedoIsFound) {
    // Milk: red light is scattered less than blue and goes farther, hardly more absorbed.
    World world;
    const DipoleMedium milk[3] = {{0.70, 0.0014, 1.3}, {1.22, 0.0025, 1.3}, {1.90, 0.0142, 1.3}};
    world.profile = testing_world::dipole_profile(milk, 8);
    world.diffuse =
        TranslucentRelief(world.relief)
            .render(irradiance_from_lights(world.relief, world.lights, 1.3), world.profile);
    BssrdfOptions options;
    options.use_shadows = false;
    options.smoothing = 0.01;
    const MediumEstimate found =
        estimate_bssrdf(world.noisy(), world.relief, Mask(), world.lights, options);
    for (int c = 0; c < 3; ++c)
        EXPECT_LT(profile_ks_distance(found.profile(), world.profile, c, 2.0, 250), 0.12) << c;
}

TEST(Bssrdf, StepProfilesFallAndQmrAgreesInTotal) {
    const World world;
    BssrdfOptions options;
    options.use_shadows = false;
    const MediumEstimate monotone =
        estimate_bssrdf(world.diffuse, world.relief, Mask(), world.lights, options);
    for (std::size_t k = 1; k < monotone.piecewise.r.size(); ++k)
        EXPECT_TRUE((monotone.piecewise.rd[k] <= monotone.piecewise.rd[k - 1] * 1.000001).all());
    options.solver = ProfileSolver::Qmr;
    const MediumEstimate qmr =
        estimate_bssrdf(world.diffuse, world.relief, Mask(), world.lights, options);
    EXPECT_NEAR(qmr.channels[0].albedo / monotone.channels[0].albedo, 1, 0.5);
}

TEST(Bssrdf, BlackChannelIsNotIdentifiable) {
    World world;
    for (Rgb& pixel : world.diffuse) pixel[2] = 0;
    const MediumEstimate found = estimate_bssrdf(world.diffuse, world.relief, Mask(), world.lights);
    EXPECT_EQ(found.channels[2].outcome, Outcome::NotIdentifiable);
    EXPECT_FALSE(found.warnings.empty());
    for (const Rgbd& rd : found.profile().rd) EXPECT_TRUE(rd.isFinite().all());
}

TEST(Bssrdf, LimitedAlbedoKeepsRatios) {
    MediumEstimate medium;
    for (std::size_t c = 0; c < 3; ++c) {
        medium.fit[c] = {0.1 * (3.0 - static_cast<double>(c)), -0.7, 0, -1};
        medium.channels[c].albedo = medium.fit[c].total();
        medium.channels[c].mean_radius_px = medium.fit[c].mean_radius();
    }
    const double ratio = medium.channels[2].albedo / medium.channels[0].albedo;
    EXPECT_GT(limit_albedo(medium), 1);
    EXPECT_NEAR(medium.channels[0].albedo, kPlausibleAlbedo, 1e-9);
    EXPECT_NEAR(medium.channels[2].albedo / medium.channels[0].albedo, ratio, 1e-9);
}

TEST(TranslucencyLights, KeyAndBackLightComeBack) {
    const World world;
    TranslucencyLightOptions options;
    options.softness = 0.5;
    const ViewLightsEstimate found =
        estimate_translucency_lights(world.noisy(), world.relief, Mask(), {}, options);
    EXPECT_LT(nearest_deg(found.lights, world.lights.lights[0].direction), 8);
    EXPECT_LT(nearest_deg(found.lights, world.lights.lights[1].direction), 20);
    EXPECT_LT(found.relative_residual, 0.1);
}

TEST(TranslucencyLights, SoftMaterialIsNotTakenForSoftLight) {
    // One channel cannot tell a wide kernel under lamps from a narrow one under a bright sky; three
    // that scatter differently can.
    const World world;
    TranslucencyLightOptions options;
    options.softness = 0.5;
    const ViewLightsEstimate found =
        estimate_translucency_lights(world.noisy(), world.relief, Mask(), {}, options);
    EXPECT_NEAR(found.ambient_share, luminance(world.lights.ambient) / world.lights.total(), 0.06);
    double radius = 0;
    const MediumEstimate known =
        estimate_bssrdf(world.diffuse, world.relief, Mask(), world.lights, {});
    for (const ChannelFit& channel : known.channels) radius += channel.mean_radius_px / 3;
    EXPECT_NEAR(found.kernel_px / radius, 1, 0.35);
}

TEST(TranslucencyLights, SameBitsOnAnyThreadCount) {
    const World world;
    set_thread_count(1);
    const auto one = estimate_translucency_lights(world.diffuse, world.relief, Mask(), {});
    set_thread_count(0);
    const auto all = estimate_translucency_lights(world.diffuse, world.relief, Mask(), {});
    ASSERT_EQ(one.lights.lights.size(), all.lights.lights.size());
    for (std::size_t l = 0; l < one.lights.lights.size(); ++l)
        EXPECT_EQ(one.lights.lights[l].direction, all.lights.lights[l].direction);
}

TEST(TranslucencyLights, BlackPictureIsNotIdentifiable) {
    World world;
    for (Rgb& pixel : world.diffuse) pixel.setZero();
    const auto found = estimate_translucency_lights(world.diffuse, world.relief, Mask(), {});
    EXPECT_EQ(found.outcome, Outcome::NotIdentifiable);
    EXPECT_FALSE(found.reason.empty());
}

TEST(LopezMoreno, FindsTheKeyOnALambertianBall) {
    const Relief ball = ellipsoid(200, 90, 90);
    const Vec3 light = Vec3(-0.6, 0.5, 0.62).normalized();
    ImageRgb shaded(200, 200);
    for (std::size_t i = 0; i < shaded.size(); ++i) {
        if (ball.mask[i] <= 127) continue;
        shaded[i] =
            Rgb::Constant(0.02f + 0.6f * static_cast<float>(std::max(
                                             0.0, ball.normals[i].cast<double>().dot(light))));
    }
    const ViewLightsEstimate found = estimate_lopez_moreno_lights(shaded, ball, Mask());
    ASSERT_FALSE(found.lights.lights.empty());
    EXPECT_LT(nearest_deg(found.lights, light), 22);  // about its published accuracy
}

TEST(Highlights, SpotIsFoundFilledAndPointsToItsLamp) {
    World world;
    const Vec3 lamp = world.lights.lights[0].direction;
    const Vec3 half = (lamp + Vec3(0, 0, 1)).normalized();
    ImageRgb photo = world.diffuse;
    double brightest = 0;
    for (const Rgb& pixel : photo) brightest = std::max<double>(brightest, pixel.maxCoeff());
    for (std::size_t i = 0; i < photo.size(); ++i) {
        if (world.relief.mask[i] <= 127) continue;
        photo[i] *= static_cast<float>(0.5 / brightest);
        world.diffuse[i] = photo[i];
        const double lobe =
            std::pow(std::max(0.0, world.relief.normals[i].cast<double>().dot(half)), 300);
        photo[i] = (photo[i] + static_cast<float>(lobe)).min(1.0f);
    }
    const Highlights found = find_highlights(photo, world.relief.mask, 1.0);
    ASSERT_EQ(found.blobs.size(), 1u);
    const std::vector<HighlightLight> lights = highlight_lights(found, world.relief);
    EXPECT_LT(degrees(angle_between(lights[0].direction, lamp)), 4);
    double worst = 0;
    for (std::size_t i = 0; i < photo.size(); ++i)
        worst = std::max<double>(worst, (found.diffuse[i] - world.diffuse[i]).abs().maxCoeff());
    EXPECT_LT(worst, 0.12);
}

TEST(HighlightLights, SpotsOfOneLampVoteTogether) {
    const Relief relief = ellipsoid(220, 100, 80);
    // Three spots: two where a key lamp mirrors (one a little off), one of another lamp.
    const auto pixel_of = [&](const Vec3& lamp) {
        const Vec3 half = (lamp + Vec3(0, 0, 1)).normalized();
        std::size_t best = 0;
        for (std::size_t i = 0; i < relief.mask.size(); ++i) {
            if (relief.mask[i] > 127 && relief.normals[i].cast<double>().dot(half) >
                                            relief.normals[best].cast<double>().dot(half)) {
                best = i;
            }
        }
        return best;
    };
    const Vec3 key = Vec3(-0.5, 0.55, 0.67).normalized(), other = Vec3(0.8, 0.3, -0.4).normalized();
    Highlights highlights;
    highlights.core = Mask(220, 220);
    highlights.residual = ImageRgb(220, 220);
    for (const Vec3& lamp : {key, Vec3(-0.48, 0.63, 0.62).normalized(), other}) {
        HighlightBlob blob;
        blob.pixels = {pixel_of(lamp)};
        blob.weight = lamp == other ? 3 : 2;
        highlights.core[blob.pixels[0]] = 255;
        highlights.residual[blob.pixels[0]] = Rgb::Ones();
        highlights.blobs.push_back(blob);
    }
    const std::vector<HighlightLight> lights = highlight_lights(highlights, relief);
    ASSERT_EQ(lights.size(), 2u);
    EXPECT_EQ(lights[0].votes, 2);  // together heavier than the single one
    EXPECT_LT(degrees(angle_between(lights[0].direction, key)), 6);
    EXPECT_EQ(lights[1].votes, 1);
    EXPECT_LT(degrees(angle_between(lights[1].direction, other)), 4);
}

TEST(TranslucencyLights, LampOfTwoHighlightsIsHeld) {
    const World world;
    HighlightLight lamp;
    lamp.direction = Vec3(-0.45, 0.6, 0.66).normalized();  // 4 degrees from the true one
    lamp.votes = 2;
    const std::vector<HighlightLight> lamps = {lamp};
    const auto found = estimate_translucency_lights(world.diffuse, world.relief, Mask(), lamps,
                                                    {.use_votes = false});
    EXPECT_LT(nearest_deg(found.lights, lamp.direction), 1e-6);
}

TEST(TranslucencyLights, HighlightsTellTheLampsWhereTheShapeIsWrong) {
    World world;
    // Waves of normals, 15 degrees wrong, that the picture does not have.
    Relief wavy = world.relief;
    for (int y = 0; y < wavy.mask.height(); ++y) {
        for (int x = 0; x < wavy.mask.width(); ++x) {
            float& z = wavy.depth_px(x, y);
            z *= static_cast<float>(1 + 0.12 * std::sin(x / 9.0) * std::cos(y / 11.0 + 0.6));
        }
    }
    wavy.normals = relief_normals(wavy.depth_px, wavy.mask);
    // Each lamp mirrors three times, up to 20 degrees off where the surface faces us; one highlight
    // is false.
    const Vec3 key = world.lights.lights[0].direction, back = world.lights.lights[1].direction;
    std::vector<HighlightLight> highlights;
    const auto add = [&](const Vec3& lamp, const Vec3& off, double weight) {
        HighlightLight light;
        light.direction = (lamp + off).normalized();
        light.intensity = Rgbd::Constant(weight);
        highlights.push_back(light);
    };
    add(back, Vec3(0.05, 0.08, 0.0), 0.4);
    add(key, Vec3(0.3, 0.05, -0.1), 0.15);
    add(key, Vec3(-0.1, -0.3, 0.1), 0.15);
    add(key, Vec3(-0.2, 0.2, 0.05), 0.1);
    add(back, Vec3(-0.1, -0.05, 0.1), 0.1);
    add(Vec3(0.2, -0.8, 0.4), Vec3::Zero(), 0.1);
    const auto voted = estimate_translucency_lights(world.diffuse, wavy, Mask(), highlights);
    EXPECT_LT(nearest_deg(voted.lights, key), 10);
    EXPECT_LT(nearest_deg(voted.lights, back), 12);
    EXPECT_EQ(voted.lights.lights.size(), 2u);
    const auto shading =
        estimate_translucency_lights(world.diffuse, wavy, Mask(), highlights, {.use_votes = false});
    EXPECT_GT(nearest_deg(shading.lights, key) + nearest_deg(shading.lights, back),
              nearest_deg(voted.lights, key) + nearest_deg(voted.lights, back));
}

TEST(BallHeights, ShadowsTellHowFarABallLiesBefore) {
    // The last ball lies 0.9 radii further before the others than touching asks for.
    const std::vector<Ball> truth = {{Vec3f(60, -60, 0), 36},
                                     {Vec3f(132, -62, 0), 36},
                                     {Vec3f(62, -134, 0), 36},
                                     {Vec3f(134, -134, 0), 36},
                                     {Vec3f(104, -92, 86), 36}};
    std::vector<Ball> touching = truth;
    touching.back().centre_px.z() -= 33;
    Mask mask(200, 200);
    for (int y = 0; y < 200; ++y) {
        for (int x = 0; x < 200; ++x) {
            for (const Ball& ball : truth) {
                const Vec2f v(static_cast<float>(x) - ball.centre_px.x(),
                              static_cast<float>(-y) - ball.centre_px.y());
                if (v.norm() < ball.radius_px) mask(x, y) = 255;
            }
        }
    }
    Relief relief = relief_of_balls(mask, truth);
    relief.ball_albedo = Rgbd(0.3, 0.35, 0.1);
    ViewLights lights;
    lights.lights.push_back({Vec3(-0.6, 0.55, 0.58).normalized(), Rgbd::Constant(1.0)});
    lights.lights.push_back({Vec3(0.75, 0.2, -0.63).normalized(), Rgbd::Constant(0.8)});
    const ImageRgb picture = render_object(relief, lights, apple(5));
    const Relief start = relief_of_balls(mask, touching);
    const auto found = estimate_translucency_lights(picture, start, Mask(), {});
    const std::vector<Ball> balls = refine_ball_heights(start, picture, Mask(), found);
    const auto height = [](const std::vector<Ball>& all) {
        float others = 0;
        for (std::size_t k = 0; k + 1 < all.size(); ++k) others += all[k].centre_px.z();
        return all.back().centre_px.z() - others / static_cast<float>(all.size() - 1);
    };
    EXPECT_NEAR(height(balls), height(truth), 15);  // 33 before
    // From the truth there is nothing to gain.
    const auto at_truth = estimate_translucency_lights(picture, relief, Mask(), {});
    EXPECT_NEAR(height(refine_ball_heights(relief, picture, Mask(), at_truth)), height(truth), 8);
    EXPECT_LT(at_truth.relative_residual, found.relative_residual);
    EXPECT_GT(at_truth.ball_albedo[1], 0.1);  // that they light each other is seen
    // Lamps that no picture told of say nothing of heights either.
    EXPECT_EQ(height(refine_ball_heights(start, picture, Mask(), {})), height(touching));
}

TEST(TranslucencyLights, GroundIsFoundWhereItShines) {
    World world;
    world.lights.from_below = Rgbd::Constant(0.8);
    world.diffuse =
        TranslucentRelief(world.relief)
            .render(irradiance_from_lights(world.relief, world.lights, 1.3), world.profile);
    const auto found =
        estimate_translucency_lights(world.diffuse, world.relief, Mask(), {}, {.softness = 0.5});
    EXPECT_GT(luminance(found.lights.from_below), 0.2);
    EXPECT_LT(nearest_deg(found.lights, world.lights.lights[0].direction), 10);
}

TEST(Bssrdf, SurfaceWithoutFresnelIsRecognised) {
    const World world;
    const ViewLights& lights = world.lights;
    TranslucentRenderOptions options;
    options.eta = 1;
    const ImageRgb plain =
        TranslucentRelief(world.relief, options)
            .render(irradiance_from_lights(world.relief, lights, 1.0), world.profile);
    BssrdfOptions fit;
    fit.use_shadows = false;
    fit.smoothing = 0.01;
    EXPECT_FALSE(estimate_bssrdf(plain, world.relief, Mask(), lights, fit).is_fresnel);
    EXPECT_TRUE(estimate_bssrdf(world.diffuse, world.relief, Mask(), lights, fit).is_fresnel);
}

TEST(ReliefRefinement, ShadingOfKnownLightsGivesTheBumps) {
    const Relief smooth = ellipsoid(220, 100, 80);
    Relief bumpy = smooth;
    for (int y = 0; y < 220; ++y) {
        for (int x = 0; x < 220; ++x) {
            if (!is_inside(bumpy.mask, x, y)) continue;
            const double bump = 8 * std::sin(0.07 * x) * std::cos(0.08 * y);
            bumpy.depth_px(x, y) +=
                static_cast<float>(bump * std::sqrt(smooth.depth_px(x, y) / 80));
        }
    }
    bumpy.normals = relief_normals(bumpy.depth_px, bumpy.mask);
    ViewLights lights = key_and_back(smooth, 1.0);
    lights.lights.push_back({Vec3(0.6, -0.3, 0.74).normalized(), Rgbd::Constant(0.8)});
    const ReliefIrradiance light = irradiance_from_lights(bumpy, lights, 1.0);
    const auto error_deg = [&](const Relief& relief) {
        double sum = 0, count = 0;
        for (std::size_t i = 0; i < relief.mask.size(); ++i) {
            if (relief.mask[i] <= 127) continue;
            sum += degrees(
                angle_between(relief.normals[i].cast<double>(), bumpy.normals[i].cast<double>()));
            count += 1;
        }
        return sum / count;
    };
    const Relief found = refine_relief(smooth, light.front, Mask(), lights, 0, 1.0);
    EXPECT_LT(error_deg(found), 0.65 * error_deg(smooth));
    // A picture that the start explains already changes nothing.
    const ReliefIrradiance plain = irradiance_from_lights(smooth, lights, 1.0);
    const Relief same = refine_relief(smooth, plain.front, Mask(), lights, 0, 1.0);
    for (std::size_t i = 0; i < same.mask.size(); ++i) {
        if (same.mask[i] > 127) {
            EXPECT_NEAR(same.depth_px[i], smooth.depth_px[i], 3);
        }
    }
}

TEST(Highlights, MatteObjectHasNone) {
    World world;
    const Highlights found = find_highlights(world.diffuse, world.relief.mask, 1e30);
    EXPECT_TRUE(found.blobs.empty());
    EXPECT_EQ(found.method, HighlightMethod::None);
}

}  // namespace
}  // namespace vitrine
