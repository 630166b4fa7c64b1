#include "pipeline/series_renderer.h"

#include "base/error.h"
#include "image/colour.h"
#include "pipeline/mlds_presets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

StimuliOptions small_pictures() {
    StimuliOptions options;
    options.size_px = 40;
    options.samples_per_pixel = 4;
    options.max_samples_per_pixel = 64;
    options.deviation_l = 0.3;
    options.photon_count = 20'000;
    options.gather_radius_m = 0.004;
    return options;
}

/// Root mean square over the pixels of the difference of L*.
double rms_delta_l(const ImageRgb& a, const ImageRgb& b) {
    const auto lightness = [](const Rgb& p) {
        return double(lab_from_linear(p.max(0.0f).min(1.0f)).x());
    };
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = lightness(a[i]) - lightness(b[i]);
        sum += d * d / static_cast<double>(a.size());
    }
    return std::sqrt(sum);
}

TEST(SeriesRenderer, MoreSamplesGoWhereThePictureIsNoisy) {
    const SeriesRenderer renderer(make_mlds_preset("sphere_point"), small_pictures());
    for (const Image<int>* samples : {&renderer.lamp_samples(), &renderer.surroundings_samples()}) {
        const auto [least, most] = std::minmax_element(samples->begin(), samples->end());
        EXPECT_EQ(*least, 4);
        EXPECT_GT(*most, 4);
        EXPECT_LE(*most, 64);
    }
    // The upper left corner is bare table; glass and the edge of its shadow are elsewhere.
    EXPECT_EQ(renderer.lamp_samples()(2, 2), 4);
}

TEST(SeriesRenderer, SamplesDealtOutBeatAsManyEverywhere) {
    const SeriesSpec spec = make_mlds_preset("sphere_point");
    StimuliOptions dealt = small_pictures();
    dealt.smooth_px = 0;
    const SeriesRenderer planned(spec, dealt);
    double mean = 0;
    for (const int n : planned.lamp_samples()) {
        mean += n / double(planned.lamp_samples().size());
    }
    StimuliOptions even = dealt;
    even.samples_per_pixel = even.max_samples_per_pixel = static_cast<int>(std::ceil(mean));
    const auto noise_of = [&](StimuliOptions options) {
        const ImageRgb a = SeriesRenderer(spec, options).render(1.43);
        options.exposure = planned.exposure();
        ++options.seed;
        return rms_delta_l(a, SeriesRenderer(spec, options).render(1.43));
    };
    dealt.exposure = even.exposure = planned.exposure();
    EXPECT_LT(noise_of(dealt), noise_of(even));
}

TEST(SeriesRenderer, BlurOfTheSurroundingsRemovesNoiseNotLight) {
    SeriesSpec spec = make_mlds_preset("sphere_point");
    spec.scene.lights.clear();  // all around only
    StimuliOptions rough = small_pictures();
    rough.exposure = 10;
    rough.max_samples_per_pixel = rough.samples_per_pixel = 8;
    StimuliOptions exact = rough;
    exact.smooth_px = 0;
    exact.max_samples_per_pixel = exact.samples_per_pixel = 256;
    StimuliOptions noisy = rough;
    noisy.smooth_px = 0;
    rough.smooth_px = 1.0;
    const ImageRgb truth = SeriesRenderer(spec, exact).render(1.43);
    const double without = rms_delta_l(SeriesRenderer(spec, noisy).render(1.43), truth);
    const double with = rms_delta_l(SeriesRenderer(spec, rough).render(1.43), truth);
    EXPECT_LT(with, 0.6 * without) << "blurred " << with << ", as rendered " << without;
}

TEST(SeriesRenderer, SameNumbersMakeNoDifferenceFarFromTheGlass) {
    const SeriesRenderer renderer(make_mlds_preset("sphere_point"), small_pictures());
    const ImageRgb a = renderer.render(1.40), b = renderer.render(1.46);
    // Along the left edge nothing of the glass is near: only a few photons differ.
    double largest = 0;
    for (int y = 0; y < 16; ++y) {
        largest =
            std::max<double>(largest, (a(1, y) - b(1, y)).abs().maxCoeff() / a(1, y).maxCoeff());
    }
    EXPECT_LT(largest, 0.01);
    EXPECT_GT(rms_delta_l(a, b), 0.2);
}

TEST(SeriesRenderer, PathsNeedLampsThatTheyCanMeet) {
    StimuliOptions options = small_pictures();
    options.use_photons = false;
    EXPECT_THROW(SeriesRenderer(make_mlds_preset("cup_spot"), options), InputError);
    const SeriesRenderer pane(make_mlds_preset("pane_disc"), options);
    EXPECT_GT(pane.exposure(), 0.0);
}

TEST(SeriesRenderer, ASceneWithoutLightIsRefused) {
    SeriesSpec spec = make_mlds_preset("sphere_point");
    spec.scene.lights.clear();
    spec.scene.ambient_radiance = Rgb::Zero();
    EXPECT_THROW(SeriesRenderer(spec, small_pictures()), InputError);
}

}  // namespace
}  // namespace vitrine
