#include "base/rng.h"
#include "estimate/ward_clusters.h"
#include "geometry/primitives.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// A ball on a grey table under one lamp, seen from six sides, shaded by the model that is fitted.
class SpecularTest : public ::testing::Test {
  protected:
    SpecularTest() {
        Mesh table = make_plane(0.8, 0.0, 16);
        table.colours.assign(table.vertices.size(), Rgb(0.1f, 0.09f, 0.08f));
        add_part("scan", std::move(table));
        add_part("object_0", make_sphere(0.05, Vec3(0, 0, 0.05), 48));
        options_.disc_samples = 8;
        options_.lobe_samples = 4;
        options_.sigma_grid = 12;
        light_.opaque_mask = kScanMask | object_mask(0);
        const Vec3 position(0.5, 0.2, 0.8);
        light_.lights = {{position, -position.normalized(), 0.03, Rgb(2.0f, 1.8f, 1.6f)}};
        light_.ambient = Rgb::Constant(0.02f);
        for (int view = 0; view < 6; ++view) add_view(view);
    }

    void add_part(const std::string& name, Mesh mesh) {
        Part part;
        part.name = name;
        part.mesh = std::make_shared<const Mesh>(std::move(mesh));
        scene_.parts.push_back(part);
    }

    void add_view(int view) {
        const EstimationScene world(scene_);
        const double angle = kPi * view / 5.0;
        const Vec3f eye(0.6f * static_cast<float>(std::cos(angle)),
                        0.6f * static_cast<float>(std::sin(angle)), 0.5f);
        const Frame frame((Vec3f(0, 0, 0.05f) - eye).normalized());
        for (int v = -7; v <= 7; ++v)
            for (int u = -7; u <= 7; ++u) {
                ObjectPixel pixel;
                pixel.frame = view;
                pixel.eye = eye;
                pixel.direction = (frame.normal + 0.009f * static_cast<float>(u) * frame.tangent +
                                   0.009f * static_cast<float>(v) * frame.bitangent)
                                      .normalized();
                const Hit hit = world.accel().closest({eye, pixel.direction});
                if (!hit.is_hit() || hit.part != 1) continue;
                const Mesh& mesh = world.mesh(1);
                pixel.surface = {hit_point(mesh, hit), shading_normal(mesh, hit)};
                pixels_.push_back(pixel);
            }
    }

    void shade(const Ward& ward, float noise) {
        const EstimationScene world(scene_);
        const std::vector<Rgb> picture =
            predict_ward(SpecularModel(world, pixels_, light_, options_), ward);
        Rng rng(1);
        for (std::size_t i = 0; i < pixels_.size(); ++i)
            pixels_[i].radiance =
                (picture[i] + noise * Rgb(rng.next_float() - 0.5f, rng.next_float() - 0.5f,
                                          rng.next_float() - 0.5f))
                    .max(0.0f);
    }

    void clip(float level) {
        for (ObjectPixel& pixel : pixels_)
            for (int c = 0; c < 3; ++c) {
                if (pixel.radiance[c] < level) continue;
                pixel.radiance[c] = level;
                pixel.is_clipped = true;
                pixel.is_at_least[static_cast<std::size_t>(c)] = true;
            }
    }

    WardFit fit() {
        const EstimationScene world(scene_);
        return fit_ward(SpecularModel(world, pixels_, light_, options_), 0.3, options_);
    }

    static Ward bronze(double sigma_x, double sigma_y) {
        Ward ward;
        ward.rho_d = Rgb(0.2f, 0.12f, 0.05f);
        ward.rho_s = Rgb(0.3f, 0.25f, 0.15f);
        ward.sigma_x = sigma_x;
        ward.sigma_y = sigma_y;
        return ward;
    }

    Scene scene_;
    SpecularOptions options_;
    KnownLight light_;
    std::vector<ObjectPixel> pixels_;
};

TEST_F(SpecularTest, RecoversExactlyAndWithNoise) {
    shade(bronze(0.12, 0.12), 0.0f);
    WardFit exact = fit();
    EXPECT_NEAR(exact.sigma.value, 0.12, 0.003);
    EXPECT_EQ(exact.ward.sigma_x, exact.ward.sigma_y);
    EXPECT_EQ(exact.sigma.outcome, Outcome::Converged);
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(exact.ward.rho_d[c], bronze(1, 1).rho_d[c], 0.005);
        EXPECT_NEAR(exact.ward.rho_s[c], bronze(1, 1).rho_s[c], 0.015);
    }
    shade(bronze(0.12, 0.12), 0.02f);
    const WardFit noisy = fit();
    EXPECT_NEAR(noisy.sigma.value, 0.12, 0.006);
    EXPECT_NEAR(noisy.ward.rho_s[0], 0.3, 0.03);
    EXPECT_EQ(noisy.ward.sigma_x, noisy.ward.sigma_y);
}

TEST_F(SpecularTest, ClippedHighlightsSayAtLeast) {
    shade(bronze(0.12, 0.12), 0.0f);
    clip(0.5f);
    const WardFit fitted = fit();
    EXPECT_GT(fitted.censored_count, 10);
    EXPECT_NEAR(fitted.sigma.value, 0.12, 0.006);
    EXPECT_NEAR(fitted.ward.rho_s[0], 0.3, 0.03);
    // What the clip hides entirely is still known to be bright: without it nothing would say so.
    for (ObjectPixel& pixel : pixels_) pixel.is_at_least = {};
    EXPECT_EQ(fit().censored_count, 0);
}

TEST_F(SpecularTest, AHighlightThatClipsEntirelySpeaksForTheLobe) {
    shade(bronze(0.05, 0.05), 0.05f);
    clip(0.25f);
    const WardFit fitted = fit();
    ASSERT_GT(fitted.censored_count, 5);
    const double unclipped = std::log(fitted.cost_diffuse / fitted.cost);
    const double all = std::log(fitted.cost_diffuse_with_clipped / fitted.cost_with_clipped);
    EXPECT_GT(all, 0.15);
    EXPECT_GT(all, unclipped);
    // A diffuse surface that the lamp overexposes is no metal.
    Ward paint;
    paint.rho_d = Rgb(0.8f, 0.7f, 0.6f);
    paint.rho_s = Rgb::Zero();
    for (ObjectPixel& pixel : pixels_) {
        pixel.is_clipped = false;
        pixel.is_at_least = {};
    }
    shade(paint, 0.05f);
    clip(0.6f);
    const WardFit bright = fit();
    ASSERT_GT(bright.censored_count, 5);
    EXPECT_LT(std::log(bright.cost_diffuse_with_clipped / bright.cost_with_clipped), 0.15);
}

TEST_F(SpecularTest, NormalNoiseIsTakenOutOrSaysNo) {
    shade(bronze(0.12, 0.12), 0.0f);
    options_.normal_noise_rad = 0.04;
    const WardFit fitted = fit();
    EXPECT_NEAR(fitted.sigma.value, std::sqrt(0.12 * 0.12 - 2 * 0.04 * 0.04), 0.003);
    EXPECT_EQ(fitted.sigma.outcome, Outcome::Converged);
    options_.normal_noise_rad = 0.08;
    EXPECT_EQ(fit().sigma.outcome, Outcome::NotIdentifiable);
}

TEST_F(SpecularTest, BrushedMetalHasTwoRoughnesses) {
    shade(bronze(0.07, 0.2), 0.01f);
    const WardFit fitted = fit();
    EXPECT_NEAR(fitted.ward.sigma_x, 0.07, 0.007);
    EXPECT_NEAR(fitted.ward.sigma_y, 0.2, 0.02);
    EXPECT_NEAR(fitted.ward.rho_s[0], 0.3, 0.03);
    EXPECT_LT(fitted.cost, 0.9 * fitted.cost_isotropic);
    options_.may_be_brushed = false;
    EXPECT_EQ(fit().ward.sigma_x, fit().ward.sigma_y);
}

TEST_F(SpecularTest, CertificateAgreesWithTheFastSearch) {
    shade(bronze(0.1, 0.1), 0.01f);
    options_.is_certified = true;
    const WardFit fitted = fit();
    ASSERT_TRUE(fitted.certificate.has_value());
    EXPECT_TRUE(fitted.certificate->is_complete);
    EXPECT_NEAR(fitted.certificate->sigma, fitted.sigma.value, 0.01 * fitted.sigma.value);
    EXPECT_GT(fitted.certificate->nodes, 1);
    EXPECT_LE(fitted.certificate->lower_bound, fitted.certificate->upper_bound);
}

TEST_F(SpecularTest, TwoPaintsShareWhatOneCannotTell) {
    Ward red = bronze(0.12, 0.12), green = red;
    red.rho_d = Rgb(0.4f, 0.05f, 0.05f);
    green.rho_d = Rgb(0.05f, 0.3f, 0.08f);
    shade(red, 0.01f);
    std::vector<ObjectPixel> upper = pixels_;
    shade(green, 0.01f);
    for (std::size_t i = 0; i < pixels_.size(); ++i)
        if (pixels_[i].surface.position.z() > 0.06f) pixels_[i] = upper[i];
    const EstimationScene world(scene_);
    const ClusteredWard fitted = fit_ward_clusters(world, pixels_, light_, 0.3, options_);
    ASSERT_EQ(fitted.clusters.size(), 2u);
    EXPECT_EQ(fitted.paints.count, 2);
    const auto at_top = static_cast<std::size_t>(fitted.paints.at(Vec3f(0, 0, 0.1f)));
    const WardFit& top = fitted.clusters[at_top].fit;
    const WardFit& bottom = fitted.clusters[1 - at_top].fit;
    EXPECT_NEAR(top.ward.rho_d[0], 0.4, 0.05);
    EXPECT_NEAR(bottom.ward.rho_d[1], 0.3, 0.05);
    EXPECT_NEAR(top.sigma.value, 0.12, 0.02);
    EXPECT_NEAR(bottom.sigma.value, 0.12, 0.02);
    EXPECT_NEAR(fitted.clusters[0].area_fraction + fitted.clusters[1].area_fraction, 1.0, 1e-9);

    shade(red, 0.01f);
    EXPECT_EQ(fit_ward_clusters(world, pixels_, light_, 0.3, options_).clusters.size(), 1u);
}

TEST_F(SpecularTest, TheDoubtOfTheLightGoesOnIntoTheReflectances) {
    const Ward truth = bronze(0.12, 0.12);
    shade(truth, 0.01f);
    const WardFit sure = fit();
    constexpr double kDoubt = 0.2;
    light_.stddev_irradiance_ratio = kDoubt;
    for (DiscLight& lamp : light_.lights) lamp.intensity_w_per_sr *= static_cast<float>(1 - kDoubt);
    const WardFit doubtful = fit();  // of a light taken for too dim by one deviation
    for (int c = 0; c < 3; ++c) {
        const double error = doubtful.ward.rho_d[c] - truth.rho_d[c];
        EXPECT_GT(error, 2.0 * sure.stddev_rho_d[c]) << c;
        EXPECT_LT(error, 2.0 * doubtful.stddev_rho_d[c]) << c;
        EXPECT_GT(doubtful.stddev_rho_d[c], kDoubt * doubtful.ward.rho_d[c]) << c;
        EXPECT_GT(doubtful.stddev_rho_s[c], kDoubt * doubtful.ward.rho_s[c]) << c;
    }
    EXPECT_NEAR(doubtful.sigma.stddev, sure.sigma.stddev, 0.3 * sure.sigma.stddev);
}

TEST_F(SpecularTest, PaintHasNoLobe) {
    Ward paint = bronze(0.1, 0.1);
    paint.rho_s.setZero();
    shade(paint, 0.01f);
    const WardFit fitted = fit();
    EXPECT_GT(fitted.cost, 0.95 * fitted.cost_diffuse);
}

}  // namespace
}  // namespace vitrine
