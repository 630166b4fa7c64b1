#include "perception/computational_observer.h"

#include "base/error.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vitrine {
namespace {

/// A grey field with a bright spot whose place moves with the index.
std::vector<ImageRgb> moving_spot(const std::vector<double>& ior, double px_per_unit) {
    std::vector<ImageRgb> pictures;
    for (const double n : ior) {
        ImageRgb picture(96, 64, Rgb::Constant(0.2f));
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 96; ++x) {
                const double dx = x - 30 - px_per_unit * (n - ior.front()), dy = y - 32;
                picture(x, y) +=
                    Rgb::Constant(0.5f * static_cast<float>(std::exp(-(dx * dx + dy * dy) / 72)));
            }
        }
        pictures.push_back(picture);
    }
    return pictures;
}

TEST(ComputationalObserver, SeesNothingInEqualPictures) {
    const ImageRgb grey(32, 32, Rgb::Constant(0.3f));
    EXPECT_EQ(visible_difference(grey, grey), 0.0);
    const std::vector<double> ior = {1.4, 1.5};
    const auto prediction = predict_thresholds(std::vector{grey, grey}, ior);
    EXPECT_TRUE(std::isinf(prediction.value));
    EXPECT_TRUE(
        std::isinf(prediction_from_json(prediction_to_json(prediction, {}), "p").local[0][1]));
}

TEST(ComputationalObserver, MeasuresAKnownStepOfLightness) {
    // CIE L* of linear y: 116 y^(1/3) - 16.
    const double l1 = 116 * std::cbrt(0.30) - 16, l2 = 116 * std::cbrt(0.32) - 16;
    const double difference = visible_difference(ImageRgb(16, 16, Rgb::Constant(0.30f)),
                                                 ImageRgb(16, 16, Rgb::Constant(0.32f)));
    EXPECT_NEAR(difference, l2 - l1, 0.01);
}

TEST(ComputationalObserver, LeavesClippedPixelsOut) {
    ImageRgb a(16, 16, Rgb::Constant(0.3f)), b = a;
    for (int x = 0; x < 16; ++x) {
        a(x, 3) = Rgb::Constant(1.5f);
        b(x, 3) = Rgb::Constant(4.0f);
    }
    EXPECT_EQ(visible_difference(a, b), 0.0);
}

TEST(ComputationalObserver, ThresholdHalvesWhereThePictureChangesTwiceAsFast) {
    const std::vector<double> ior = {1.40, 1.41, 1.42, 1.43, 1.44, 1.45};
    const double slow = predict_thresholds(moving_spot(ior, 50), ior).value;
    const double fast = predict_thresholds(moving_spot(ior, 100), ior).value;
    EXPECT_NEAR(fast / slow, 0.5, 0.05);
    // It does not hang on the steps of the series.
    const std::vector<double> finer = {1.400, 1.405, 1.410, 1.415, 1.420, 1.425, 1.430, 1.435};
    EXPECT_NEAR(predict_thresholds(moving_spot(finer, 50), finer).value / slow, 1.0, 0.1);
}

TEST(ComputationalObserver, RefusesPicturesThatDoNotMatch) {
    const std::vector<double> ior = {1.4, 1.5};
    EXPECT_THROW(predict_thresholds(std::vector<ImageRgb>{ImageRgb(4, 4)}, ior), InputError);
    EXPECT_THROW(predict_thresholds(std::vector{ImageRgb(4, 4), ImageRgb(5, 4)}, ior), InputError);
}

}  // namespace
}  // namespace vitrine
