#include "pipeline/insertion_measure.h"

#include "image/filter.h"

namespace vitrine {
namespace {

constexpr double kBlur_px = 2.0;        // half a pixel of misalignment must not decide
constexpr double kChangedShare = 0.02;  // of the picture's mean: clearly visible

ImageRgb change(const ImageRgb& with, const ImageRgb& without, double saturation_level) {
    const auto top = static_cast<float>(saturation_level);
    ImageRgb difference(with.width(), with.height());
    for (std::size_t i = 0; i < difference.size(); ++i) {
        difference[i] = with[i].max(0.0f).min(top) - without[i].max(0.0f).min(top);
    }
    return gaussian_blur(difference, kBlur_px);
}

struct Region {
    double error = 0, signal = 0, count = 0;
    double relative() const { return signal > 0 ? std::sqrt(error / signal) : 0.0; }
    double floor(double noise_mean_square) const {
        return signal > 0 ? std::sqrt(noise_mean_square * count / signal) : 0.0;
    }
    void add(const Rgb& estimated, const Rgb& truth) {
        error += (estimated - truth).square().sum();
        signal += truth.square().sum();
        count += 3;
    }
};

/// Mean square of the true change where nothing changes: far from every visible change.
double noise_mean_square(const ImageRgb& truth, const Mask& virtual_mask, double threshold) {
    const ImageRgb smooth = gaussian_blur(truth, 8.0);
    Mask changed = virtual_mask;
    for (std::size_t i = 0; i < changed.size(); ++i) {
        if (std::abs(smooth[i].mean()) > 0.25 * threshold) changed[i] = 255;
    }
    const Mask near_change = dilate(changed, 8);
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (near_change[i] > 127) continue;
        sum += truth[i].square().sum();
        count += 3;
    }
    return count > 0 ? sum / count : 0.0;
}

}  // namespace

InsertionError measure_insertion(const ImageRgb& true_with, const ImageRgb& true_without,
                                 const ImageRgb& estimated_with, const ImageRgb& estimated_without,
                                 const Mask& virtual_mask, double saturation_level) {
    VITRINE_CHECK(true_with.same_size(estimated_with));
    VITRINE_CHECK(true_with.same_size(virtual_mask));
    const ImageRgb truth = change(true_with, true_without, saturation_level);
    const ImageRgb estimate = change(estimated_with, estimated_without, saturation_level);
    double level = 0;
    for (const Rgb& pixel : true_without) {
        level += pixel.min(static_cast<float>(saturation_level)).mean();
    }
    const double threshold = kChangedShare * level / static_cast<double>(true_without.size());
    const Mask core = erode(virtual_mask, 2), surround = dilate(virtual_mask, 4);
    Region object, darker, brighter, all;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        all.add(estimate[i], truth[i]);
        if (core[i] > 127) object.add(estimate[i], truth[i]);
        if (surround[i] > 127) continue;
        if (truth[i].mean() < -threshold) darker.add(estimate[i], truth[i]);
        if (truth[i].mean() > threshold) brighter.add(estimate[i], truth[i]);
    }
    const Region changed{darker.error + brighter.error, darker.signal + brighter.signal,
                         darker.count + brighter.count};
    const double noise = noise_mean_square(truth, virtual_mask, threshold);
    return {object.relative(),    darker.relative(),   brighter.relative(), changed.relative(),
            all.relative(),       object.floor(noise), darker.floor(noise), brighter.floor(noise),
            changed.floor(noise), all.floor(noise)};
}

}  // namespace vitrine
