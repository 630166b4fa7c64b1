#include "insert_regions.h"

#include "image/filter.h"
#include "image/image_io.h"

namespace vitrine {
namespace {
namespace fs = std::filesystem;

Rgb clipped(const Rgb& v, float top) { return v.max(0.0f).min(top); }

}  // namespace

ImageRgb raw_difference(const ImageRgb& with, const ImageRgb& without, float top) {
    ImageRgb d(with.width(), with.height());
    for (std::size_t i = 0; i < d.size(); ++i) {
        d[i] = clipped(with[i], top) - clipped(without[i], top);
    }
    return d;
}

ImageRgb blurred_noise_variance(const ImageRgb& error) {
    ImageRgb variance(error.width(), error.height());
    for (int y = 1; y + 1 < error.height(); ++y) {
        for (int x = 1; x + 1 < error.width(); ++x) {
            const Rgb around =
                (error(x - 1, y) + error(x + 1, y) + error(x, y - 1) + error(x, y + 1)) / 4.0f;
            variance(x, y) = (error(x, y) - around).square() /
                             static_cast<float>(1.25 * 4 * kPi * kBlurPx * kBlurPx);
        }
    }
    return variance;
}

RegionError region_error(const ImageRgb& truth, const ImageRgb& estimate, double noise_rms,
                         const ImageRgb& noise_variance, const Mask& inside) {
    double difference = 0, noise = 0;
    RegionError result;
    double& power = result.power;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (inside[i] < 128) continue;
        difference += (estimate[i] - truth[i]).square().sum();
        power += truth[i].square().sum();
        noise += noise_variance[i].sum();
        ++result.count;
    }
    if (power > 0) {
        result.noise = std::sqrt(noise / power);
        result.error = std::sqrt(difference / power);
        result.floor = noise_rms * std::sqrt(3.0 * static_cast<double>(result.count) / power);
    }
    return result;
}

FarNoise far_noise(const ImageRgb& truth, const ImageRgb& raw_truth, const ImageRgb& estimate,
                   double level) {
    const ImageRgb variance = blurred_noise_variance(raw_truth);
    double sum = 0, predicted = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (estimate[i].abs().maxCoeff() > 0.002 * level) continue;
        sum += truth[i].square().sum();
        predicted += variance[i].sum();
        count += 3;
    }
    const double n = std::max<double>(1, static_cast<double>(count));
    return {std::sqrt(sum / n), std::sqrt(predicted / n)};
}

TrueFrame make_frame(const Camera& camera, const ImageRgb& plate, const ImageRgb& with,
                     const Mask& virtual_mask, float top) {
    TrueFrame frame;
    frame.camera = camera;
    frame.plate = plate;
    frame.with = with;
    frame.virtual_mask = virtual_mask;
    frame.raw_true = raw_difference(frame.with, frame.plate, top);
    frame.d_true = gaussian_blur(frame.raw_true, kBlurPx);
    for (const Rgb& p : frame.plate) frame.level += clipped(p, top).mean();
    frame.level /= static_cast<double>(frame.plate.size());
    const Mask around = dilate(virtual_mask, 4);
    frame.regions[0] = erode(virtual_mask, 2);
    for (int k = 1; k < 4; ++k) frame.regions[k] = Mask(camera.width, camera.height);
    for (std::size_t i = 0; i < around.size(); ++i) {
        frame.regions[3][i] = 255;
        if (around[i] >= 128 || !(frame.d_true[i].abs().maxCoeff() > 0.02 * frame.level)) continue;
        frame.regions[frame.d_true[i].sum() < 0 ? 1 : 2][i] = 255;
    }
    return frame;
}

TrueFrame read_frame(const fs::path& folder, const Camera& camera, float top) {
    return make_frame(camera, read_exr_rgb(folder / ".." / "linear" / (camera.id + ".exr")),
                      read_exr_rgb(folder / (camera.id + "_with.exr")),
                      read_mask(folder / (camera.id + "_virtual_mask.png")), top);
}

}  // namespace vitrine
