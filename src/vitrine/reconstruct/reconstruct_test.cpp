#include "reconstruct/revolution.h"
#include "reconstruct/scan.h"
#include "reconstruct/tiny_world.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(Scan, FindsTheTableAndItsColours) {
    TinyWorldOptions options;
    options.has_liar = false;
    const TinyWorld world = make_tiny_world(options);
    const Scan scan = make_scan(world.capture, kept_poses());
    EXPECT_LT(angle_between(scan.support_plane.normal, Vec3::UnitZ()), radians(0.1));
    EXPECT_NEAR(scan.support_plane.offset_m, 0.0, 5e-4);
    EXPECT_LT(scan.depth_residual_m, 1.5e-3);
    ASSERT_EQ(scan.mesh.colours.size(), scan.mesh.vertices.size());
}

TEST(Scan, RefusesACaptureWithoutDepth) {
    TinyWorld world = make_tiny_world();
    for (RgbdFrame& frame : world.capture.frames) frame.depth_m = ImageF(240, 160);
    EXPECT_THROW(make_scan(world.capture, kept_poses()), InputError);
}

/// Outlines of a true body in the cameras of the tiny world.
std::vector<OutlineView> outlines_of(const TinyWorld& world) {
    std::vector<OutlineView> outlines;
    for (std::size_t i = 0; i < world.liar_masks.size(); ++i) {
        outlines.push_back(
            outline_view(world.capture.frames[i].camera, world.liar_masks[i], Mask()));
    }
    return outlines;
}

TEST(Revolution, FindsTheAxisOfABallAndRoundsItsPole) {
    const TinyWorld world = make_tiny_world();
    const std::vector<OutlineView> outlines = outlines_of(world);
    const Plane table;
    const Vec3 foot = find_axis_foot(outlines, table, Vec3(0.004, -0.003, 0), 0.06, 0.1);
    EXPECT_LT(foot.norm(), 1e-3);
    ProfileField profile = carve_profile(outlines, table, foot, 0.06, 0.1, 0.001);
    const float before = profile.sample(0, 0.084);
    complete_poles(profile);
    EXPECT_GT(profile.sample(0, 0.085), 0.0f);  // outside the ball, inside the bare cone
    EXPECT_GE(profile.sample(0, 0.084), before);
    EXPECT_LT(profile.sample(0, 0.078), 0.0f);
    EXPECT_NEAR(profile.sample(0.04, 0.0405), 0.0f, 1e-3f);
}

TEST(VisualHull, LargerThanTheBodyAndOpenToHiddenPixels) {
    const TinyWorld world = make_tiny_world();
    std::vector<OutlineView> outlines = outlines_of(world);
    Box3 box;
    box.extend(Vec3(-0.06, -0.06, -0.01));
    box.extend(Vec3(0.06, 0.06, 0.1));
    const ScalarGrid phi = carve(outlines, box, 0.002);
    EXPECT_LT(phi.sample(Vec3(0, 0, 0.04)), -0.03f);
    EXPECT_GT(phi.sample(Vec3(0.05, 0, 0.04)), 0.005f);
    const Mesh hull = hull_mesh(phi, 0.0, 1.0, Plane());
    EXPECT_TRUE(find_defects(hull).is_closed());
    EXPECT_GT(volume(hull), volume(world.liar) * 0.98);
    // A view that sees only half of the ball, the rest hidden, must not cut the hidden half off.
    Mask half = world.liar_masks[0], hidden(half.width(), half.height());
    for (int y = 0; y < half.height(); ++y) {
        for (int x = 0; x < half.width() / 2; ++x) {
            half(x, y) = 0;
            hidden(x, y) = 255;
        }
    }
    outlines[0] = outline_view(world.capture.frames[0].camera, half, hidden);
    const Mesh same = hull_mesh(carve(outlines, box, 0.002), 0.0, 1.0, Plane());
    EXPECT_GT(volume(same), 0.99 * volume(hull));
}

}  // namespace
}  // namespace vitrine
