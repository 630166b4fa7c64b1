#include "capture/check.h"

#include "base/file.h"
#include "capture/exposure_gains.h"
#include "capture/made_capture.h"
#include "capture/read_capture.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

/// One fault at a time in a made world; each has to be named in words, and nothing else.
class Check : public testing::Test {
  protected:
    ScratchFolder folder_{"check"};
    MadeCapture made_;

    std::vector<std::string> complaints() {
        std::vector<std::string> sentences;
        for (const Verdict& verdict : check_capture(read_capture(folder_))) {
            const bool is_albedo = verdict.sentence.find("albedo") != std::string::npos;
            if (verdict.severity != Severity::Good && !is_albedo) {
                sentences.push_back(verdict.sentence);
            }
        }
        return sentences;
    }
    std::string only_complaint() {
        const std::vector<std::string> all = complaints();
        EXPECT_EQ(all.size(), 1u);
        std::string text;
        for (const std::string& sentence : all) text += sentence + "\n";
        return text;
    }
    void replace(const char* file, const std::string& old_text, const std::string& new_text) {
        std::string text = read_text_file(folder_ / file);
        const std::size_t at = text.find(old_text);
        ASSERT_NE(at, std::string::npos);
        write_text_file(folder_ / file, text.replace(at, old_text.size(), new_text));
    }
};

bool says(const std::string& text, const std::string& words) {
    return text.find(words) != std::string::npos;
}

TEST_F(Check, AGoodCaptureHasNoComplaint) {
    made_.write_tum(folder_);
    EXPECT_TRUE(complaints().empty());
}

TEST_F(Check, UnpairedStamps) {
    made_.frames = 10;
    made_.write_tum(folder_);
    replace("depth.txt", "0.1030", "0.1730");
    const std::string text = only_complaint();
    EXPECT_TRUE(says(text, "1 of 10 colour pictures have no depth within 20 ms")) << text;
    replace("depth.txt", "0.2030", "0.2730");
    replace("depth.txt", "0.3030", "0.3730");
    EXPECT_TRUE(says(capture_error(folder_), "7 of 10")) << capture_error(folder_);
}

TEST_F(Check, DepthOfAnotherUnit) {
    made_.write_tum(folder_);
    made_.write_pictures(folder_ / "rgb", folder_ / "depth", 1000);  // millimetres
    const std::string text = capture_error(folder_);
    EXPECT_TRUE(says(text, "depth_scale 1000 would make")) << text;
}

TEST_F(Check, IntrinsicsOfAnotherSize) {
    made_.write_tum(folder_);
    // Honest about their size: the pictures are half of it.
    replace("camera_intrinsic.json",
            "\"width\": 96, \"height\": 64, \"intrinsic_matrix\": [80, 0, 0, 0, 80, 0, 47.5, 31.5",
            "\"width\": 192, \"height\": 128, \"intrinsic_matrix\": [160, 0, 0, 0, 160, 0, 95.5, "
            "63.5");
    std::string text = capture_error(folder_);
    EXPECT_TRUE(says(text, "another size: multiply fx, fy, cx and cy by 0.5")) << text;
    // The size set right by hand, the numbers forgotten.
    replace("camera_intrinsic.json", "\"width\": 192, \"height\": 128",
            "\"width\": 96, \"height\": 64");
    text.clear();
    for (const std::string& sentence : complaints()) text += sentence + "\n";
    EXPECT_TRUE(says(text, "intrinsics of pictures of another size?")) << text;
}

TEST_F(Check, ExposureThatChanges) {
    made_.exposure = [](int i) { return i == 5 ? 0.7 : 1.0; };
    made_.write_tum(folder_);
    const std::string text = only_complaint();
    EXPECT_TRUE(says(text, "frame 000005 is 0.7")) << text;
    EXPECT_TRUE(says(text, "lock the exposure")) << text;
}

TEST_F(Check, MotionBlur) {
    made_.blur_px = [](int i) { return i == 2 ? 6 : 0; };
    made_.write_tum(folder_);
    const std::string text = only_complaint();
    EXPECT_TRUE(says(text, "frame 000002 looks blurred")) << text;
}

TEST_F(Check, TooFewViews) {
    made_.frames = 5;
    made_.write_tum(folder_);
    const std::string text = only_complaint();
    EXPECT_TRUE(says(text, "5 frames of 96 x 64 pixels: too few")) << text;
}

TEST_F(Check, OneViewHasNothingToCompareWith) {
    made_.frames = 1;
    made_.write_tum(folder_);
    const std::string text = only_complaint();
    EXPECT_TRUE(says(text, "1 frame of 96 x 64 pixels: too few")) << text;
}

TEST_F(Check, NoParallax) {
    made_.orbit_rad = 0.004;
    made_.write_tum(folder_);
    const std::string text = only_complaint();
    EXPECT_TRUE(says(text, "too little parallax")) << text;
}

TEST_F(Check, ExposureGainsAreFoundAndTakenOut) {
    const std::vector<double> truth = {1.0, 0.8, 1.25, 1.0, 1.1, 0.9, 1.0, 0.7};
    made_.exposure = [&](int i) { return truth[static_cast<std::size_t>(i)]; };
    made_.write_tum(folder_);
    Capture capture = read_capture(folder_);
    std::vector<Camera> cameras = cameras_of(capture);
    // Poses that are still to be refined.
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].cam_from_world =
            rigid_from_twist(Vec3(0.004, i % 2 ? 0.004 : -0.004, 0), Vec3(0.003, 0, 0)) *
            cameras[i].cam_from_world;
    }
    const ExposureGains gains = estimate_exposure_gains(capture, cameras);
    EXPECT_TRUE(gains.is_significant);
    EXPECT_LT(gains.disagreement_after, 0.3 * gains.disagreement_before);
    double mean_log = 0;
    for (const double g : truth) mean_log += std::log(g) / 8;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        EXPECT_NEAR(gains.gain[i] / (truth[i] / std::exp(mean_log)), 1.0, 0.02) << i;
    }
    apply_exposure_gains(gains.gain, capture);
    EXPECT_NEAR(capture.frames[7].exposure, gains.gain[7], 1e-12);
    const ExposureGains left = estimate_exposure_gains(capture, cameras_of(capture));
    EXPECT_LT(left.disagreement_before, 0.02);
}

TEST_F(Check, EqualExposuresAreLeftAlone) {
    made_.write_tum(folder_);
    const Capture capture = read_capture(folder_);
    const ExposureGains gains = estimate_exposure_gains(capture, cameras_of(capture));
    EXPECT_GT(gains.pairs, 16u);
    EXPECT_FALSE(gains.is_significant);
    for (const double g : gains.gain) EXPECT_EQ(g, 1.0);
}

TEST_F(Check, TwoViewsCannotTellExposureFromShine) {
    made_.frames = 2;
    made_.exposure = [](int i) { return i == 0 ? 1.0 : 0.5; };
    made_.write_tum(folder_);
    const Capture capture = read_capture(folder_);
    EXPECT_FALSE(estimate_exposure_gains(capture, cameras_of(capture)).is_significant);
}

}  // namespace
}  // namespace vitrine
