#include "pipeline/mlds_stimuli.h"

#include "base/error.h"
#include "base/file.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "math/statistics.h"
#include "perception/computational_observer.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

/// L* as displayed, after a blur of the linear light.
ImageF lightness(const ImageRgb& picture, double blur_sigma_px) {
    ImageRgb shown = picture;
    for (Rgb& pixel : shown) pixel = pixel.max(0.0f).min(1.0f);
    if (blur_sigma_px > 0) shown = gaussian_blur(shown, blur_sigma_px);
    ImageF l(shown.width(), shown.height());
    for (std::size_t i = 0; i < l.size(); ++i) l[i] = lab_from_linear(shown[i]).x();
    return l;
}

/// What one of two equal quantities is off by in 99 pixels of 100.
double noise_between(const ImageF& a, const ImageF& b) {
    std::vector<double> deviation(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        deviation[i] = std::abs(double(a[i]) - double(b[i])) / std::sqrt(2.0);
    }
    return quantile(std::move(deviation), 0.99);
}

ImageF difference(const ImageF& a, const ImageF& b) {
    ImageF d = a;
    for (std::size_t i = 0; i < d.size(); ++i) d[i] -= b[i];
    return d;
}

/// @param pair, again two neighbours of the series, each rendered with two seeds
StimulusNoise measure_noise(const std::array<ImageRgb, 2>& pair,
                            const std::array<ImageRgb, 2>& again) {
    StimulusNoise noise;
    const auto measure = [&](double blur_px, double& picture, double& change) {
        const ImageF a = lightness(pair[0], blur_px), b = lightness(pair[1], blur_px);
        const ImageF c = lightness(again[0], blur_px), d = lightness(again[1], blur_px);
        picture = std::max(noise_between(a, c), noise_between(b, d));
        change = noise_between(difference(b, a), difference(d, c));
    };
    measure(0, noise.picture, noise.difference);
    measure(ComputationalObserverOptions{}.blur_sigma_px, noise.picture_seen,
            noise.difference_seen);
    return noise;
}

}  // namespace

StimulusSeries render_stimuli(const SeriesSpec& spec, const fs::path& folder,
                              const StimuliOptions& options, const Progress& progress) {
    constexpr double kPlanned = 0.08, kRendered = 0.85;  // shares of the time
    const std::size_t count = spec.ior.size(), middle = count / 2;
    const SeriesRenderer renderer(spec, options, progress.part(0.0, kPlanned));
    StimulusSeries series;
    series.title = spec.title;
    series.ior = spec.ior;
    series.integrator = options.use_photons ? "photon" : "path";
    series.exposure = renderer.exposure();
    std::array<ImageRgb, 2> pair;
    for (std::size_t i = 0; i < count; ++i) {
        const double step = (kRendered - kPlanned) / static_cast<double>(count);
        const double at = kPlanned + step * static_cast<double>(i);
        ImageRgb picture = renderer.render(spec.ior[i], progress.part(at, at + step));
        const std::string stem = fmt::format("stimulus_{:02d}", i + 1);
        series.images.push_back(stem + ".png");
        series.linear.push_back(stem + ".exr");
        write_png(folder / series.images.back(), linear_to_srgb8(picture));
        write_exr(folder / series.linear.back(), picture);
        if (i + 1 == middle || i == middle) pair[i - (middle - 1)] = std::move(picture);
    }
    const SeriesRenderer repeated = renderer.with_seed(options.seed + 1);
    const std::array<ImageRgb, 2> again = {
        repeated.render(spec.ior[middle - 1], progress.part(kRendered, 0.9)),
        repeated.render(spec.ior[middle], progress.part(0.9, 1.0))};
    series.noise = measure_noise(pair, again);
    write_text_file(folder / "stimuli.json", series_to_json(series));
    return series;
}

std::vector<ImageRgb> read_linear_stimuli(const fs::path& folder, const StimulusSeries& series) {
    if (series.linear.empty()) {
        throw InputError({folder.string(), "linear pictures (EXR) beside the series", "none",
                          "render the series with `vitrine mlds stimuli`"});
    }
    std::vector<ImageRgb> pictures;
    for (const std::string& file : series.linear) {
        if (fs::path(file).filename().string() != file) {
            throw InputError({folder.string(), "file names without a folder", file, ""});
        }
        pictures.push_back(read_exr_rgb(folder / file));
    }
    return pictures;
}

}  // namespace vitrine
