#include "base/error.h"
#include "reconstruct/pose_refinement.h"
#include "reconstruct/scan.h"
#include "reconstruct/tiny_world.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

std::vector<Camera> cameras_of(const Capture& capture) {
    std::vector<Camera> cameras;
    for (const RgbdFrame& frame : capture.frames) cameras.push_back(frame.camera);
    return cameras;
}

double worst_shift(const std::vector<Camera>& cameras, const Capture& truth) {
    // Frame 0 holds the world: compare after putting it where it truly is.
    const Rigid3 align =
        truth.frames[0].camera.cam_from_world.inverse() * cameras[0].cam_from_world;
    double worst = 0;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const Vec3 centre = align * cameras[i].centre_in_world();
        worst = std::max(worst, (centre - truth.frames[i].camera.centre_in_world()).norm());
    }
    return worst;
}

TEST(PoseRefinement, RecoversPerturbedPoses) {
    const TinyWorld world = make_tiny_world();
    std::vector<Camera> cameras = cameras_of(world.capture);
    for (std::size_t i = 1; i < cameras.size(); ++i) {
        const double s = i % 2 ? 1 : -1;
        const Vec3 turn(0.5 * s, i % 3 ? 0.4 : -0.4, 0.3), shift(0.005 * s, 0.004, -0.005 * s);
        cameras[i].cam_from_world =
            rigid_from_twist(radians(1.0) * turn, shift) * cameras[i].cam_from_world;
    }
    EXPECT_GT(worst_shift(cameras, world.capture), 0.006);
    const PoseRefinement refined = refine_poses(world.capture, cameras, {});
    EXPECT_TRUE(refined.is_accepted);
    EXPECT_LT(worst_shift(refined.cameras, world.capture), 0.0015);
}

TEST(PoseRefinement, LeavesExactPosesAlone) {
    const TinyWorld world = make_tiny_world();
    const PoseRefinement refined = refine_poses(world.capture, cameras_of(world.capture), {});
    EXPECT_LT(worst_shift(refined.cameras, world.capture), 5e-4);
}

TEST(Tracking, RefusesFramesWithoutTexture) {
    TinyWorldOptions options;
    options.views = 4;
    options.width = 160;
    options.height = 120;
    TinyWorld world = make_tiny_world(options);
    for (RgbdFrame& frame : world.capture.frames) {
        frame.colour = ImageRgb(160, 120, Rgb::Constant(0.5f));
    }
    ScanOptions track;
    track.poses = PoseMode::Track;
    try {
        make_scan(world.capture, track);
        FAIL() << "poses found in grey frames";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("000003"), std::string::npos);
    }
}

TEST(Tracking, FindsPosesOfTexturedViews) {
    TinyWorldOptions options;
    options.views = 4;
    options.arc_deg = 30;
    options.width = 320;
    options.height = 240;
    TinyWorld world = make_tiny_world(options);
    const Capture truth = world.capture;
    for (RgbdFrame& frame : world.capture.frames) frame.camera.cam_from_world = Rigid3();
    world.capture.has_poses = false;
    const Scan scan = make_scan(world.capture);
    EXPECT_LT(worst_shift(scan.cameras, truth), 0.003);
    EXPECT_NEAR(scan.support_plane.offset_m, 0.0, 1e-9);
    EXPECT_GT(scan.cameras[0].centre_in_world().z(), 0.1);
}

}  // namespace
}  // namespace vitrine
