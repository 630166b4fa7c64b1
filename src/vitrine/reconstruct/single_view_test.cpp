#include "reconstruct/single_view.h"

#include "image/filter.h"
#include "reconstruct/tiny_world.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(SingleView, OutlinesTheThingWithoutDepth) {
    const TinyWorld world = make_tiny_world();
    for (const std::size_t i : {0u, 4u, 7u}) {
        const RgbdFrame& frame = world.capture.frames[i];
        const std::vector<Outline> outlines =
            find_outlines(frame, frame.camera, Plane(), world.capture.saturation_level);
        ASSERT_EQ(outlines.size(), 1u) << i;
        EXPECT_GT(intersection_over_union(outlines[0].silhouette, world.liar_masks[i]), 0.8) << i;
        EXPECT_EQ(outlines[0].frame, frame.id);
    }
}

TEST(SingleView, NothingAmongThingsWithDepth) {
    TinyWorldOptions options;
    options.has_liar = false;
    const TinyWorld world = make_tiny_world(options);
    const RgbdFrame& frame = world.capture.frames[2];
    EXPECT_TRUE(
        find_outlines(frame, frame.camera, Plane(), world.capture.saturation_level).empty());
}

TEST(SingleView, TwoThatTouchAreTwo) {
    TinyWorldOptions options;
    options.has_liar = false;
    options.views = 1;
    TinyWorld world = make_tiny_world(options);
    RgbdFrame& frame = world.capture.frames[0];
    Mask first(240, 160), second(240, 160);
    for (int y = 0; y < 160; ++y) {
        for (int x = 0; x < 240; ++x) {
            const bool a = std::hypot(x - 112, y - 88) < 17, b = std::hypot(x - 141, y - 92) < 16;
            if (a) first(x, y) = 255;
            if (b) second(x, y) = 255;
            if (a || b) frame.depth_m(x, y) = 0;
            if (a || b) frame.colour(x, y) = Rgb(0.05f, 0.3f, 0.9f);
        }
    }
    OutlineOptions anywhere;
    anywhere.min_rim_on_plane = 0;  // one of them stands before the flat box
    const std::vector<Outline> outlines =
        find_outlines(frame, frame.camera, Plane(), 1.0, anywhere);
    ASSERT_EQ(outlines.size(), 2u);
    for (const Mask& truth : {first, second}) {
        const double best = std::max(intersection_over_union(outlines[0].silhouette, truth),
                                     intersection_over_union(outlines[1].silhouette, truth));
        EXPECT_GT(best, 0.75);
    }
}

}  // namespace
}  // namespace vitrine
