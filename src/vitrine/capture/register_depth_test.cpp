#include "capture/register_depth.h"

#include "base/file.h"
#include "capture/made_capture.h"
#include "image/image_io.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

/// A coarse depth camera 5 cm beside a fine colour camera, its lens distorted: Kinect v2's shape.
struct Rig {
    Camera colour;
    DepthCamera depth_camera;

    Rig() {
        const MadeCapture made{.width = 288, .height = 192, .focal_px = 240};
        colour = made.camera(1);
        Camera& own = depth_camera.intrinsic.camera;
        own = {"", 128, 106, 91, 91, 62.0, 53.5, {}};
        depth_camera.intrinsic.distortion = {0.09, -0.05, 0.001, -0.0005, 0.01};
        depth_camera.colour_from_depth =
            rigid_from_twist(Vec3(0.01, -0.02, 0.005), Vec3(-0.05, 0.001, 0.002));
        own.cam_from_world = depth_camera.colour_from_depth.inverse() * colour.cam_from_world;
    }

    ImageF measured() const {
        const Camera& own = depth_camera.intrinsic.camera;
        ImageF depth(own.width, own.height);
        for (int v = 0; v < own.height; ++v) {
            for (int u = 0; u < own.width; ++u) {
                const Vec2 bent((u - own.cx) / own.fx, (v - own.cy) / own.fy);
                const Vec2 ideal = depth_camera.intrinsic.distortion.undistort(bent);
                depth(u, v) =
                    static_cast<float>(look_at_made_world(own, ideal.x() * own.fx + own.cx,
                                                          ideal.y() * own.fy + own.cy)
                                           .depth_m);
            }
        }
        return depth;
    }
};

TEST(RegisterDepth, AgreesWithTheTruthAndLetsNothingShineThrough) {
    const Rig rig;
    const ImageF ours = register_depth(rig.measured(), rig.depth_camera, rig.colour);
    int good = 0, behind = 0, before = 0, none = 0;
    for (int v = 8; v + 8 < ours.height(); ++v) {
        for (int u = 8; u + 8 < ours.width(); ++u) {
            const double truth = look_at_made_world(rig.colour, u, v).depth_m;
            if (ours(u, v) <= 0) {
                ++none;
            } else if (std::abs(ours(u, v) - truth) < 0.002) {
                ++good;
            } else {
                ++(ours(u, v) > truth ? behind : before);
            }
        }
    }
    const double all = good + behind + before + none;
    EXPECT_GT(good / all, 0.93);
    // Only a seam along the block's outline may be wrong: half a coarse pixel.
    EXPECT_LT(behind / all, 0.01);
    EXPECT_LT(before / all, 0.01);
}

TEST(RegisterDepth, NothingBehindTheBlock) {
    // Two centimetres inside the block's outline the floor must not show, from either camera.
    const Rig rig;
    const ImageF ours = register_depth(rig.measured(), rig.depth_camera, rig.colour);
    for (int v = 2; v + 2 < ours.height(); ++v) {
        for (int u = 2; u + 2 < ours.width(); ++u) {
            double deepest = 0;  // of the truth around: all block means deep inside
            for (const int du : {-6, 0, 6}) {
                for (const int dv : {-6, 0, 6}) {
                    const MadePoint p = look_at_made_world(rig.colour, u + du, v + dv);
                    const Vec3 world = rig.colour.unproject(u + du, v + dv, p.depth_m);
                    deepest = std::max(deepest, world.z() < 0.01 ? 1e9 : p.depth_m);
                }
            }
            if (deepest > 1e8) continue;
            EXPECT_LT(ours(u, v), deepest + 0.004) << u << " " << v;
        }
    }
}

TEST(RegisterDepth, TheSameCameraIsTheIdentity) {
    const MadeCapture made;
    const Camera camera = made.camera(0);
    ImageF depth(made.width, made.height);
    for (int v = 0; v < made.height; ++v) {
        for (int u = 0; u < made.width; ++u) {
            depth(u, v) = static_cast<float>(look_at_made_world(camera, u, v).depth_m);
        }
    }
    depth(40, 30) = 0;
    const ImageF same = register_depth(depth, {{camera, {}}, Rigid3()}, camera);
    for (std::size_t i = 0; i < same.size(); ++i) EXPECT_NEAR(same[i], depth[i], 1e-5) << i;
}

TEST(RegisterDepth, UndistortIsTheInverse) {
    const LensDistortion lens{-0.28, 0.09, 0.001, -0.002, 0.01};
    for (const Vec2& ideal : {Vec2(0, 0), Vec2(0.5, -0.3), Vec2(-0.6, 0.4)}) {
        EXPECT_LT((lens.undistort(lens.distort(ideal)) - ideal).norm(), 1e-8);
    }
}

TEST(RegisterDepth, ACaptureWithADepthCameraOfItsOwn) {
    const ScratchFolder folder("own_depth");
    const MadeCapture made{.width = 288, .height = 192, .focal_px = 240};
    made.write_tum(folder);
    Rig rig;
    Camera& own = rig.depth_camera.intrinsic.camera;
    for (int i = 0; i < made.frames; ++i) {
        own.cam_from_world =
            rig.depth_camera.colour_from_depth.inverse() * made.camera(i).cam_from_world;
        const ImageF depth = rig.measured();
        Image<std::uint16_t> codes(depth.width(), depth.height());
        for (std::size_t p = 0; p < codes.size(); ++p) {
            codes[p] = static_cast<std::uint16_t>(std::lround(5000 * depth[p]));
        }
        write_png16(folder / "depth" / (made_frame_name(i) + ".png"), codes);
    }
    EXPECT_NE(capture_error(folder).find("depth_camera_intrinsic.json"), std::string::npos);
    const LensDistortion& d = rig.depth_camera.intrinsic.distortion;
    write_text_file(
        folder / "depth_camera_intrinsic.json",
        fmt::format("{{\"width\": 128, \"height\": 106, \"intrinsic_matrix\": [91, 0, 0, 0, 91, 0, "
                    "62.0, 53.5, 1], \"distortion\": [{}, {}, {}, {}, {}]}}",
                    d.k1, d.k2, d.p1, d.p2, d.k3));
    EXPECT_NE(capture_error(folder).find("\"colour_from_depth\""), std::string::npos);
    std::string matrix;
    const Mat4 m = rig.depth_camera.colour_from_depth.matrix();
    for (int k = 0; k < 16; ++k) matrix += fmt::format("{}{}", k ? ", " : "", m(k / 4, k % 4));
    write_text_file(folder / "capture.json", "{\"colour_from_depth\": [" + matrix + "]}");
    const Capture capture = read_capture(folder);
    ASSERT_EQ(capture.frames.size(), 8u);
    const RgbdFrame& frame = capture.frames[3];
    ASSERT_TRUE(frame.depth_m.same_size(frame.colour));
    std::size_t good = 0, all = 0;
    for (int v = 10; v < 182; v += 3) {
        for (int u = 10; u < 278; u += 3) {
            ++all;
            const double truth = look_at_made_world(made.camera(3), u, v).depth_m;
            good += std::abs(frame.depth_m(u, v) - truth) < 0.002 ? 1 : 0;
        }
    }
    EXPECT_GT(double(good) / double(all), 0.93);
    write_text_file(folder / "capture.json",
                    "{\"colour_from_depth\": [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}");
    EXPECT_NE(capture_error(folder).find("a rotation and a translation"), std::string::npos);
}

TEST(ReadCapture, TakesOutLensDistortion) {
    const ScratchFolder folder("distortion");
    const MadeCapture made{.width = 192,
                           .height = 128,
                           .focal_px = 160,
                           .distortion = {-0.12, 0.03, 0.001, -0.001, 0.002}};
    made.write_tum(folder);
    const Capture capture = read_capture(folder);
    const RgbdFrame& frame = capture.frames[2];
    double worst_depth = 0, sum = 0, count = 0;
    for (int v = 12; v < 116; ++v) {
        for (int u = 12; u < 180; ++u) {
            const MadePoint truth = look_at_made_world(frame.camera, u, v);
            // Away from the block's outline, where the nearest reading may be the other side's.
            const double around = std::abs(look_at_made_world(frame.camera, u + 2, v).depth_m -
                                           look_at_made_world(frame.camera, u - 2, v).depth_m) +
                                  std::abs(look_at_made_world(frame.camera, u, v + 2).depth_m -
                                           look_at_made_world(frame.camera, u, v - 2).depth_m);
            if (around > 0.03) continue;
            worst_depth = std::max(worst_depth, std::abs(frame.depth_m(u, v) - truth.depth_m));
            sum += std::abs(frame.colour(u, v)[0] - truth.brightness);
            count += 1;
        }
    }
    EXPECT_LT(worst_depth, 0.006);  // half a pixel of an oblique floor
    EXPECT_LT(sum / count, 0.008);  // resampling and 8 bits
}

}  // namespace
}  // namespace vitrine
