#include "base/error.h"
#include "capture/read_capture.h"
#include "reconstruct/pose_refinement.h"
#include "reconstruct/scan.h"
#include "reconstruct/tiny_world.h"
#include "reconstruct/tracking.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

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

TEST(PoseRefinement, RecoversPosesAndGainsTogether) {
    TinyWorld world = make_tiny_world();
    std::vector<Camera> cameras = cameras_of(world.capture);
    double mean_log = 0;
    const auto gain = [](std::size_t i) { return i % 3 == 0 ? 0.75 : i % 3 == 1 ? 1.0 : 1.3; };
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        mean_log += std::log(gain(i)) / double(cameras.size());
        for (Rgb& pixel : world.capture.frames[i].colour) pixel *= static_cast<float>(gain(i));
        const double s = i % 2 ? 1 : -1;
        if (i == 0) continue;
        cameras[i].cam_from_world =
            rigid_from_twist(radians(0.7) * Vec3(0.6 * s, 0.6, 0.5), Vec3(0.005 * s, 0.005, 0)) *
            cameras[i].cam_from_world;
    }
    Capture given = world.capture;
    for (std::size_t i = 0; i < cameras.size(); ++i) given.frames[i].camera = cameras[i];
    const Scan scan = make_scan(given);
    EXPECT_LT(worst_shift(scan.cameras, world.capture), 0.0015);
    const Capture even = frames_of_scan(given, scan);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        EXPECT_NEAR(scan.poses[i].exposure_gain, gain(i) / std::exp(mean_log), 0.02) << i;
        EXPECT_NEAR(even.frames[i].exposure, scan.poses[i].exposure_gain, 1e-12);
    }
}

TEST(PoseRefinement, EqualExposuresStayBitForBit) {
    const TinyWorld world = make_tiny_world(small_tiny_world());
    const Scan scan = make_scan(world.capture);
    const Capture same = frames_of_scan(world.capture, scan);
    for (std::size_t i = 0; i < same.frames.size(); ++i) {
        EXPECT_EQ(scan.poses[i].exposure_gain, 1.0);
        EXPECT_TRUE((same.frames[i].colour[777] == world.capture.frames[i].colour[777]).all());
    }
}

/// Views 10 degrees apart, without poses; `truth` keeps them.
Capture textured_views(int views, double arc_deg, Capture& truth) {
    TinyWorldOptions options;
    options.views = views;
    options.arc_deg = arc_deg;
    options.width = 320;
    options.height = 240;
    TinyWorld world = make_tiny_world(options);
    truth = world.capture;
    for (RgbdFrame& frame : world.capture.frames) frame.camera.cam_from_world = Rigid3();
    world.capture.has_poses = false;
    return world.capture;
}

void make_grey(RgbdFrame& frame) {
    frame.colour = ImageRgb(frame.colour.width(), frame.colour.height(), Rgb::Constant(0.5f));
}

TEST(Tracking, RefusesFramesWithoutTexture) {
    TinyWorldOptions options;
    options.views = 4;
    options.width = 160;
    options.height = 120;
    TinyWorld world = make_tiny_world(options);
    for (RgbdFrame& frame : world.capture.frames) make_grey(frame);
    ScanOptions track;
    track.poses = PoseMode::Track;
    try {
        make_scan(world.capture, track);
        FAIL() << "poses found in grey frames";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("000003"), std::string::npos);
    }
}

TEST(Tracking, GoesOnWithoutTheFramesThatDoNotConnect) {
    Capture truth;
    Capture capture = textured_views(7, 60, truth);
    make_grey(capture.frames[0]);  // even the first
    make_grey(capture.frames[4]);
    const Scan scan = make_scan(capture);
    EXPECT_EQ(scan.dropped, (std::vector<std::string>{"000000", "000004"}));
    ASSERT_EQ(scan.cameras.size(), 5u);
    EXPECT_EQ(scan.poses[0].id, "000001");
    const Capture kept = frames_of_scan(capture, scan);
    ASSERT_EQ(kept.frames.size(), 5u);
    EXPECT_EQ(kept.frames[3].id, "000005");
    EXPECT_LT(worst_shift(scan.cameras, frames_of_scan(truth, scan)), 0.003);
    const bool is_said = std::any_of(scan.notes.begin(), scan.notes.end(), [](const auto& note) {
        return note.find("2 of 7 frames dropped") != std::string::npos;
    });
    EXPECT_TRUE(is_said);
    for (const std::size_t i : {1u, 6u}) make_grey(capture.frames[i]);
    EXPECT_THROW(make_scan(capture), InputError);  // three are left: another capture
}

/// A camera that is carried along an arc: 2.6 degrees a frame, more frames than are compared each
/// with each. Without loops small steps add up; all poses at once take the drift out.
TEST(Tracking, FollowsAVideo) {
    TinyWorldOptions options;
    options.views = 42;
    options.arc_deg = 107;
    options.nod_deg = 0;
    TinyWorld world = make_tiny_world(options);
    const Capture truth = world.capture;
    for (RgbdFrame& frame : world.capture.frames) frame.camera.cam_from_world = Rigid3();
    world.capture.has_poses = false;
    const Scan scan = make_scan(world.capture);
    EXPECT_TRUE(scan.dropped.empty());
    ASSERT_EQ(scan.cameras.size(), 42u);
    EXPECT_LT(worst_shift(scan.cameras, truth), 0.002);
}

/// Frames next in time lie far apart, up and down: coarse pictures share few features, and most of
/// those agree.
TEST(Tracking, FindsLostFramesAgain) {
    TinyWorldOptions options;
    options.views = 42;
    options.arc_deg = 260;
    options.height = 180;
    const TinyWorld world = make_tiny_world(options);
    TrackingOptions many_only;
    many_only.min_agreeing = many_only.min_inliers;
    const auto tracked = [&](const TrackingOptions& how) {
        const Tracking tracking = track_poses(world.capture, how);
        return std::count(tracking.is_tracked.begin(), tracking.is_tracked.end(), true);
    };
    EXPECT_LT(tracked(many_only), 36);
    EXPECT_GE(tracked({}), 38);
}

TEST(Tracking, FindsPosesOfTexturedViews) {
    Capture truth;
    const Capture capture = textured_views(4, 30, truth);
    const Scan scan = make_scan(capture);
    EXPECT_LT(worst_shift(scan.cameras, truth), 0.003);
    EXPECT_NEAR(scan.support_plane.offset_m, 0.0, 1e-9);
    EXPECT_GT(scan.cameras[0].centre_in_world().z(), 0.1);
}

}  // namespace
}  // namespace vitrine
