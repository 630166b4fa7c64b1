#include "capture/capture.h"

#include "base/file.h"
#include "capture/capture_config.h"
#include "capture/check.h"
#include "capture/made_capture.h"
#include "capture/trajectory.h"
#include "image/colour.h"
#include "image/image_io.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

class CaptureFolder : public testing::Test {
  protected:
    ScratchFolder scratch_{"capture"};
    const fs::path& folder_ = scratch_.path();
    MadeCapture made_;

    void SetUp() override {
        made_.write_tum(folder_);
        write_config("\"depth_scale\": 5000, \"linear_scale\": 1.25");
    }
    void write_config(const std::string& keys) {
        write_text_file(folder_ / "capture.json", "{" + keys + "}");
    }
    std::string error() const { return capture_error(folder_); }
};

TEST_F(CaptureFolder, ReadsLinearLightMetresAndPoses) {
    const Capture capture = read_capture(folder_);
    ASSERT_EQ(capture.frames.size(), 8u);
    EXPECT_EQ(capture.frames[3].id, "000003");
    EXPECT_TRUE(capture.has_poses);
    const RasterImage png = read_png(folder_ / "rgb/000002.png");
    EXPECT_FLOAT_EQ(capture.frames[2].colour(5, 0)[0],
                    srgb_to_linear(png.codes[15] / 255.0f) * 1.25f);
    EXPECT_LT(
        (capture.frames[5].camera.centre_in_world() - made_.camera(5).centre_in_world()).norm(),
        1e-6);
    const Vec3 p = capture.frames[4].camera.unproject(20, 55, capture.frames[4].depth_m(20, 55));
    EXPECT_NEAR(p.z(), 0.0, 2e-4);
    EXPECT_GT(depth_consistency(capture, 1.0), 0.9);
    for (const Verdict& verdict : check_capture(capture)) {
        EXPECT_NE(verdict.severity, Severity::Problem) << verdict.sentence;
    }
}

TEST_F(CaptureFolder, WrongDepthScaleNamesTheLikelyOne) {
    write_config("\"depth_scale\": 1000");
    EXPECT_NE(error().find("depth_scale 5000 would make"), std::string::npos) << error();
}

TEST_F(CaptureFolder, OneTruncatedFrameIsDroppedTwoAreTooMany) {
    fs::resize_file(folder_ / "depth/000003.png", 200);
    const Capture capture = read_capture(folder_);
    EXPECT_EQ(capture.frames.size(), 7u);
    ASSERT_EQ(capture.warnings.size(), 1u);
    EXPECT_NE(capture.warnings[0].find("000003.png"), std::string::npos);
    fs::resize_file(folder_ / "rgb/000005.png", 100);
    EXPECT_NE(error().find("000005.png"), std::string::npos) << error();
}

TEST_F(CaptureFolder, MistakesAreNamed) {
    write_config("\"depth_scael\": 5000");
    EXPECT_NE(error().find("Did you mean \"depth_scale\"?"), std::string::npos) << error();
    write_config(
        "\"reference_albedo\": {\"pixel\": [\"000099\", 1, 1], \"albedo\": [0.5, 0.5, 0.5]}");
    EXPECT_NE(error().find("000099"), std::string::npos) << error();
    write_config("");
    write_text_file(folder_ / "camera_intrinsic.json",
                    R"({"width": 95, "height": 64,
                        "intrinsic_matrix": [80, 0, 0, 0, 80, 0, 47.5, 31.5, 1]})");
    EXPECT_NE(error().find("95 x 64"), std::string::npos) << error();
    fs::remove(folder_ / "rgb.txt");
    EXPECT_NE(error().find("no rgb.txt"), std::string::npos) << error();
    fs::remove_all(folder_);
    EXPECT_NE(error().find("no such folder"), std::string::npos) << error();
    fs::create_directories(folder_);
    EXPECT_NE(error().find("an empty folder"), std::string::npos) << error();
}

TEST_F(CaptureFolder, PosesThatCannotBe) {
    std::vector<StampedPose> poses = read_trajectory(folder_ / "groundtruth.txt");
    for (StampedPose& pose : poses) pose.world_from_camera = poses[0].world_from_camera;
    write_trajectory(folder_ / "groundtruth.txt", poses);
    EXPECT_NE(error().find("poses that differ"), std::string::npos) << error();
    write_text_file(folder_ / "groundtruth.txt", "0.0 0 0 0 0.5 0 0 0\n");
    EXPECT_NE(error().find("groundtruth.txt:1"), std::string::npos) << error();
    write_config("\"poses\": \"none\"");
    EXPECT_FALSE(read_capture(folder_).has_poses);
}

TEST_F(CaptureFolder, EmptyDepthIsRefused) {
    for (int i = 0; i < made_.frames; ++i) {
        write_png16(folder_ / "depth" / fmt::format("{:06d}.png", i),
                    Image<std::uint16_t>(made_.width, made_.height, 0));
    }
    EXPECT_NE(error().find("zero everywhere"), std::string::npos) << error();
}

TEST(Trajectory, AssociationUsesEachOnceNearestFirst) {
    const std::vector<int> match = associate({0.0, 0.1, 0.2}, {0.005, 0.095, 0.11, 0.5}, 0.02);
    EXPECT_EQ(match, (std::vector<int>{0, 1, -1}));
}

TEST(LensDistortion, UndistortsAStraightLine) {
    const LensDistortion lens{-0.2, 0.05, 0.001, -0.002, 0};
    const Vec2 bent = lens.distort(Vec2(0.4, 0.3));
    EXPECT_LT(bent.norm(), 0.5);
    EXPECT_TRUE(LensDistortion{}.is_none());
    EXPECT_LT((LensDistortion{}.distort(Vec2(0.1, 0.2)) - Vec2(0.1, 0.2)).norm(), 1e-15);
}

}  // namespace
}  // namespace vitrine
