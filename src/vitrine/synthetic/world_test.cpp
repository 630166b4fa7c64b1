#include "synthetic/world.h"

#include "geometry/mesh.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

WorldOptions tiny() {
    WorldOptions options;
    options.view_count = 3;
    options.width = 60;
    options.height = 45;
    options.samples_per_pixel = 4;
    options.photon_count = 20'000;
    return options;
}

TEST(World, FollowsFromItsSeed) {
    const World a = make_world(tiny()), b = make_world(tiny());
    WorldOptions other = tiny();
    other.seed = 1;
    const World c = make_world(other);
    EXPECT_EQ(a.lights[0].position_m, b.lights[0].position_m);
    EXPECT_NE(a.lights[0].position_m, c.lights[0].position_m);
    for (std::size_t i = 0; i < a.capture.frames[0].colour.size(); ++i)
        ASSERT_TRUE((a.capture.frames[0].colour[i] == b.capture.frames[0].colour[i]).all());
}

TEST(World, IsLitClosedAndHandsOverNoTruth) {
    const World world = make_world(tiny());
    ASSERT_EQ(world.labelled.parts.size(), 2u);
    EXPECT_TRUE(world.labelled.lights.empty());
    EXPECT_TRUE(std::holds_alternative<Diffuse>(world.labelled.parts[1].material));
    EXPECT_TRUE(find_defects(*world.truth.parts[1].mesh).is_closed());
    double sum = 0;
    for (const Rgb& pixel : world.capture.frames[0].colour) {
        ASSERT_TRUE(pixel.allFinite());
        sum += luminance(pixel);
    }
    EXPECT_GT(sum / static_cast<double>(world.capture.frames[0].colour.size()), 0.02);
}

}  // namespace
}  // namespace vitrine
