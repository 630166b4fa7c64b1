#include "estimate/light_fields.h"

#include "estimate/profile_fit.h"
#include "estimate/translucent_world.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

using Eigen::MatrixXd;

Relief two_balls() {
    Relief relief;
    relief.mask = Mask(80, 40);
    relief.ball_of = Image<std::int16_t>(80, 40, -1);
    relief.depth_px = ImageF(80, 40);
    relief.normals = Image<Vec3f>(80, 40, Vec3f(0, 0, 1));
    relief.inradius_px = 18;
    relief.balls = {{Vec3f(20, -20, 0), 18}, {Vec3f(58, -20, 4), 18}};
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 80; ++x) {
            for (std::size_t k = 0; k < 2; ++k) {
                const Ball& ball = relief.balls[k];
                const Vec3f at(static_cast<float>(x), static_cast<float>(-y), ball.centre_px.z());
                const float rest =
                    ball.radius_px * ball.radius_px - (at - ball.centre_px).squaredNorm();
                if (rest <= 0) continue;
                const float z = std::sqrt(rest);
                relief.mask(x, y) = 255;
                relief.ball_of(x, y) = static_cast<std::int16_t>(k);
                relief.depth_px(x, y) = ball.centre_px.z() + z;
                relief.normals(x, y) = (at - ball.centre_px + Vec3f(0, 0, z)) / ball.radius_px;
            }
        }
    }
    return relief;
}

/// Three ways to the same picture: sorted by distance, path by path, and with the paths kept.
void expect_equal_images(const Relief& relief) {
    const LitRelief object(relief, sample_relief(relief, 400),
                           draw_observations(relief, Mask(), 60, 2, 0.2, 3), 1.3, true);
    const LightFields fields =
        object.bounced(object.fields({Vec3(0.6, 0, 0.8), Vec3(-0.6, 0, -0.8)}, true), 0.5);
    const CurvedBodyFactor body = curved_body_factor(0.4);
    const LightPaths paths(object);
    const double radius = relief.inradius_px;
    const std::vector<RadialKernel> kernels = {plain_exponential(0.1 * radius),
                                               plain_exponential(0.7 * radius)};
    const std::vector<MatrixXd> images = paths.images(kernels, fields, body);
    const DistanceHistogram histogram(object.observations(), object.samples(), fields.source,
                                      fields.local, {body});
    for (std::size_t k = 0; k < kernels.size(); ++k) {
        const MatrixXd kept = KernelImage(paths, kernels[k], body)(fields);
        const MatrixXd sorted = histogram.image_of(kernels[k]);
        EXPECT_EQ(kept.cols(), 4);
        EXPECT_LT((images[k] - kept).norm(), 1e-5 * kept.norm());
        EXPECT_LT((images[k] - sorted).norm(), 5e-3 * sorted.norm());
    }
}

TEST(LightPaths, GiveTheImagesOfTheHistogramInOneBody) {
    expect_equal_images(testing_world::ellipsoid(80, 35, 28));
}

TEST(LightPaths, GiveTheImagesOfTheHistogramInACluster) { expect_equal_images(two_balls()); }

TEST(LightPaths, StayWithinTheirBall) {
    const Relief relief = two_balls();
    const LitRelief object(relief, sample_relief(relief, 400),
                           draw_observations(relief, Mask(), 60, 2, 0.2, 3), 1.3, true);
    LightFields fields = object.fields({Vec3(0, 0, 1)}, false);
    fields.local.setZero();
    for (std::size_t i = 0; i < object.samples().ball.size(); ++i)
        if (object.samples().ball[i] == 0) fields.source(static_cast<Eigen::Index>(i), 0) = 0;
    const MatrixXd image = LightPaths(object).images({plain_exponential(30)}, fields, {}).front();
    for (std::size_t p = 0; p < object.observations().ball.size(); ++p) {
        const double value = image(static_cast<Eigen::Index>(p), 0);
        EXPECT_EQ(value > 0, object.observations().ball[p] == 1);
    }
}

}  // namespace
}  // namespace vitrine
