#include "estimate/grid_lights.h"

#include "estimate/light_search.h"
#include "estimate/test_table.h"
#include "geometry/primitives.h"
#include "render/hemisphere_photons.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// A grey table with a box, seen from six sides: L = 0.5 / pi E, with E of the model under test.
class GridLightsTest : public ::testing::Test {
  protected:
    GridLightsTest() {
        Mesh scan = make_plane(1.0, 0.0, 40);
        append(scan, make_box(Vec3(0.1, 0.1, 0.12), Vec3(0.1, 0.05, 0.06)));
        scan.colours.assign(scan.vertices.size(), Rgb::Constant(0.1f));
        Part part;
        part.name = "scan";
        part.mesh = std::make_shared<const Mesh>(std::move(scan));
        scene_.parts.push_back(part);
        scene_.cameras = cameras_around_table(6, 80, 60, 75.0);
        options_.samples.count = 1500;
        options_.samples.gather_rays = 4;
        photons_.photon_count = 20'000;
    }

    void shade(const Vec3& light, double watt_per_sr, bool has_shadows) {
        const auto shade_point = [&](const EstimationScene& world, const SurfacePoint& at) -> Rgb {
            const Vec3f to_light = light.cast<float>() - at.position;
            const float cosine = std::max(0.0f, at.normal.dot(to_light.normalized()));
            const Vec3f origin = at.position + world.offset_m() * at.normal;
            if (has_shadows && world.accel().is_occluded({origin, to_light, 0.0f, 1.0f}))
                return Rgb::Zero();
            return Rgb::Constant(static_cast<float>(0.5 / kPi * watt_per_sr) * cosine /
                                 to_light.squaredNorm());
        };
        frames_ = shaded_frames(
            scene_, [&](const EstimationScene& world, const std::vector<SurfacePoint>& points,
                        const std::vector<Hit>&) {
                std::vector<Rgb> radiance;
                for (const SurfacePoint& at : points) radiance.push_back(shade_point(world, at));
                return radiance;
            });
    }

    GridLightEstimate estimate(GridLightModel model) {
        photons_.model = model;
        return estimate_grid_lights(scene_, frames_, 1e9, options_, photons_);
    }

    Scene scene_;
    std::vector<RgbdFrame> frames_;
    LightOptions options_;
    GridLightOptions photons_;
};

TEST_F(GridLightsTest, LocalRecoversALightOfTheGridExactly) {
    shade(Vec3(0.3, -0.2, 0.9), 2.0, false);
    const Vec3 on_grid = estimate(GridLightModel::Local).positions_m.at(20);
    shade(on_grid, 2.0, false);
    const GridLightEstimate e = estimate(GridLightModel::Local);
    ASSERT_EQ(e.light.lights.size(), 1u);
    EXPECT_LT((e.light.lights[0].light.position_m - on_grid).norm(), 0.02);
    EXPECT_NEAR(e.light.lights[0].light.intensity_w_per_sr[1], 2.0, 0.1);
    EXPECT_EQ(e.light.outcome, Outcome::Converged);
    EXPECT_EQ(e.positions_m.size(), 36u);
}

TEST_F(GridLightsTest, PhotonsFindTheCellOfALightWithShadows) {
    const Vec3 light(0.5, -0.35, 0.8);
    shade(light, 2.0, true);
    const GridLightEstimate e = estimate(GridLightModel::Photons);
    ASSERT_FALSE(e.light.lights.empty());
    const double error =
        angle_between(e.light.lights[0].light.position_m - e.light.reference_point_m,
                      light - e.light.reference_point_m);
    EXPECT_LT(degrees(error), 30.0);  // the cells are 24 degrees wide
    EXPECT_GT(e.light.lights[0].stddev_direction_deg, 5.0);
}

TEST_F(GridLightsTest, DarknessHasNoLight) {
    shade(Vec3(0, 0, 1), 0.0, false);
    const GridLightEstimate e = estimate(GridLightModel::Local);
    EXPECT_TRUE(e.light.lights.empty());
    EXPECT_EQ(e.light.outcome, Outcome::NotIdentifiable);
    EXPECT_FALSE(e.light.reason.empty());
}

}  // namespace
}  // namespace vitrine
