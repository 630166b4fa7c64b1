#include "pipeline/series_renderer.h"

#include "base/error.h"
#include "base/parallel.h"
#include "image/colour.h"
#include "math/statistics.h"
#include "render/sample_plan.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace vitrine {
namespace {

/// Linear display value of the picture's median: mid grey of the table, so that a caustic has room.
constexpr double kMedianOnDisplay = 0.25;
/// Shown as white, noise and all.
constexpr double kSurelyWhite = 1.5;
/// Interfaces at which both branches are followed from the camera: into the glass and out.
constexpr int kSplitDepth = 2;

bool is_environment(const Light& light) { return std::holds_alternative<EnvironmentLight>(light); }

bool has_size(const Light& light) {
    return std::holds_alternative<DiscLight>(light) || is_environment(light);
}

Scene lamps_of(Scene scene) {
    scene.ambient_radiance = Rgb::Zero();
    std::erase_if(scene.lights, is_environment);
    return scene;
}

Scene surroundings_of(Scene scene) {
    std::erase_if(scene.lights, [](const Light& light) { return !is_environment(light); });
    return scene;
}

bool is_dark(const Scene& scene) {
    return scene.lights.empty() && (scene.ambient_radiance == 0.0f).all();
}

/// d L* / d Y of CIE 1976, Y relative to white.
double lightness_slope(double y) {
    constexpr double kKnee = 216.0 / 24389.0, kLinear = 24389.0 / 27.0;
    return y > kKnee ? 116.0 / 3.0 * std::pow(y, -2.0 / 3.0) : kLinear;
}

bool has_one_colour(const Material& material) {
    const auto* diffuse = std::get_if<Diffuse>(&material);
    return diffuse && !diffuse->albedo_texture && !diffuse->use_vertex_colours;
}

/// The part of one colour that fills a pixel and its neighbours; -1: none does.
Image<int> plain_parts(const Scene& scene, const Image<int>& part) {
    Image<int> plain(part.width(), part.height(), -1);
    for (int y = 0; y < part.height(); ++y) {
        for (int x = 0; x < part.width(); ++x) {
            const int p = part(x, y);
            bool is_plain =
                p >= 0 && has_one_colour(scene.parts[static_cast<std::size_t>(p)].material);
            for (int dy = -1; dy <= 1; ++dy) {
                for (int dx = -1; dx <= 1; ++dx) is_plain &= part.clamped(x + dx, y + dy) == p;
            }
            if (is_plain) plain(x, y) = p;
        }
    }
    return plain;
}

double chosen_exposure(const ImageRgb& picture) {
    std::vector<double> levels;
    levels.reserve(picture.size());
    for (const Rgb& pixel : picture) levels.push_back(luminance(pixel));
    const double middle = median(std::move(levels));
    if (!(middle > 0)) {
        throw InputError({"scene", "light that reaches most of the picture", "black", ""});
    }
    return kMedianOnDisplay / middle;
}

}  // namespace

SeriesRenderer::SeriesRenderer(const SeriesSpec& spec, const StimuliOptions& options,
                               const Progress& progress)
    : spec_(spec), options_(options) {
    check_series(spec, spec.title);
    for (const Light& light : spec.scene.lights) {
        if (!options.use_photons && !has_size(light)) {
            throw InputError({spec.title, "lights with a size for --integrator path",
                              "a " + kind_name(light) + " light",
                              "no path finds a point through glass: use --integrator photon"});
        }
    }
    camera_ = spec.scene.cameras.front();
    if (options.size_px > 0) camera_ = camera_.scaled(options.size_px / double(camera_.width));

    const Scene middle = scene_at(spec, spec.ior[spec.ior.size() / 2]);
    const Geometry geometry = render_geometry(RenderScene(middle), camera_);
    normal_ = geometry.normal;
    // A map of the surroundings may cast edges.
    const bool is_even = std::none_of(middle.lights.begin(), middle.lights.end(), is_environment);
    plain_ = is_even && options.smooth_px > 0 ? plain_parts(middle, geometry.part)
                                              : Image<int>(camera_.width, camera_.height, -1);
    plan(middle, progress);
}

RenderedImage SeriesRenderer::render_lamps(const Scene& scene, const Progress& progress) const {
    FinalOptions final;
    final.samples_per_pixel = options_.samples_per_pixel;
    if (!lamp_samples_.empty()) final.samples = &lamp_samples_;
    final.seed = options_.seed;
    final.paths.split_depth = kSplitDepth;
    // Without photons a path finds a lamp through glass only after it left the table.
    final.paths.max_diffuse_bounces =
        options_.use_photons ? options_.diffuse_bounces : options_.diffuse_bounces + 1;
    const RenderScene lamps(lamps_of(scene));
    CausticMaps maps;
    if (options_.use_photons) {
        CausticOptions caustics;
        caustics.photon_count = options_.photon_count;
        caustics.gather_radius_m =
            options_.gather_radius_m > 0 ? options_.gather_radius_m : pixel_radius(lamps, camera_);
        caustics.seed = options_.seed;
        maps = build_caustic_maps(trace_caustics(lamps, caustics, progress.part(0.0, 0.5)).photons,
                                  caustics.gather_radius_m);
    }
    return render_image(lamps, camera_, options_.use_photons ? &maps : nullptr, final,
                        progress.part(0.5, 1.0));
}

RenderedImage SeriesRenderer::render_surroundings(const Scene& scene,
                                                  const Progress& progress) const {
    Scene surroundings = surroundings_of(scene);
    if (is_dark(surroundings)) {
        return {ImageRgb(camera_.width, camera_.height), ImageF(camera_.width, camera_.height)};
    }
    FinalOptions final;
    final.samples_per_pixel = options_.samples_per_pixel;
    if (!surroundings_samples_.empty()) final.samples = &surroundings_samples_;
    final.use_photons = false;
    final.seed = options_.seed;
    final.paths.split_depth = kSplitDepth;
    final.paths.max_diffuse_bounces = options_.diffuse_bounces + 1;
    RenderedImage image =
        render_image(RenderScene(std::move(surroundings)), camera_, final, progress);
    smooth(image.radiance);
    return image;
}

/// Gaussian over the pixels of the same flat plain part, in two directions one after the other.
void SeriesRenderer::smooth(ImageRgb& picture) const {
    constexpr float kFlatCos = 0.999f;
    const double sigma = options_.smooth_px;
    const int reach = static_cast<int>(std::ceil(3 * sigma));
    std::vector<float> weight;
    for (int d = -reach; d <= reach; ++d) {
        weight.push_back(static_cast<float>(std::exp(-0.5 * d * d / (sigma * sigma))));
    }
    for (const bool is_across : {true, false}) {
        const ImageRgb before = picture;
        parallel_for(static_cast<std::size_t>(picture.height()), 4, [&](std::size_t row) {
            const int y = static_cast<int>(row);
            for (int x = 0; x < picture.width(); ++x) {
                if (plain_(x, y) < 0) continue;
                Rgb sum = Rgb::Zero();
                float total = 0;
                for (int d = -reach; d <= reach; ++d) {
                    const int nx = is_across ? x + d : x, ny = is_across ? y : y + d;
                    if (!plain_.contains(nx, ny) || plain_(nx, ny) != plain_(x, y) ||
                        (normal_(nx, ny) * normal_(x, y)).sum() < kFlatCos) {
                        continue;
                    }
                    const float w = weight[static_cast<std::size_t>(d + reach)];
                    sum += w * before(nx, ny);
                    total += w;
                }
                picture(x, y) = sum / total;
            }
        });
    }
}

void SeriesRenderer::plan(const Scene& scene, const Progress& progress) {
    const RenderedImage lamps = render_lamps(scene, progress.part(0.0, 0.6));
    const RenderedImage surroundings = render_surroundings(scene, progress.part(0.6, 1.0));
    ImageRgb sum = lamps.radiance;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += surroundings.radiance[i];
    exposure_ = options_.exposure > 0 ? options_.exposure : chosen_exposure(sum);

    const Image<int> count(camera_.width, camera_.height, options_.samples_per_pixel);
    ImageF target(camera_.width, camera_.height);  // variance of the radiance's luminance
    for (std::size_t i = 0; i < target.size(); ++i) {
        const double y = exposure_ * luminance(sum[i]);
        const double error = options_.deviation_l / (exposure_ * lightness_slope(y));
        target[i] = y > kSurelyWhite ? std::numeric_limits<float>::max()
                                     : static_cast<float>(error * error);
    }
    const auto planned = [&](const ImageF& variance, const ImageF& wanted) {
        Image<int> samples = plan_samples(variance, count, wanted, options_.max_samples_per_pixel);
        // Powers of two of the sample sequence are spread best.
        for (int& n : samples) n = static_cast<int>(std::bit_ceil(static_cast<unsigned>(n)));
        return samples;
    };
    lamp_samples_ = planned(lamps.variance, target);
    // A blurred pixel rests on the samples of its neighbours as well.
    const auto gain =
        static_cast<float>(std::max(1.0, 4 * kPi * options_.smooth_px * options_.smooth_px));
    for (std::size_t i = 0; i < target.size(); ++i) {
        if (plain_[i] >= 0) target[i] *= gain;
    }
    surroundings_samples_ = planned(surroundings.variance, target);
}

SeriesRenderer SeriesRenderer::with_seed(std::uint64_t seed) const {
    SeriesRenderer other = *this;
    other.options_.seed = seed;
    return other;
}

ImageRgb SeriesRenderer::render(double ior, const Progress& progress) const {
    const Scene scene = scene_at(spec_, ior);
    ImageRgb picture = render_lamps(scene, progress.part(0.0, 0.8)).radiance;
    const ImageRgb around = render_surroundings(scene, progress.part(0.8, 1.0)).radiance;
    for (std::size_t i = 0; i < picture.size(); ++i) {
        picture[i] = (picture[i] + around[i]) * static_cast<float>(exposure_);
    }
    return picture;
}

}  // namespace vitrine
