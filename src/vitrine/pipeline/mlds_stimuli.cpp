#include "pipeline/mlds_stimuli.h"

#include "base/error.h"
#include "base/file.h"
#include "base/json_reader.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "math/statistics.h"
#include "render/render_image.h"
#include "scene/scene_json.h"

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

/// Linear display value of the series' median: mid grey of the table, so that a caustic has room.
constexpr double kMedianOnDisplay = 0.25;

std::size_t part_index(const Scene& scene, const std::string& name, const std::string& where) {
    std::vector<std::string> glass;
    for (std::size_t i = 0; i < scene.parts.size(); ++i) {
        if (!std::holds_alternative<Dielectric>(scene.parts[i].material)) continue;
        if (scene.parts[i].name == name) return i;
        glass.push_back(scene.parts[i].name);
    }
    std::string known;
    for (const std::string& g : glass) known += (known.empty() ? "" : ", ") + g;
    throw InputError({where, "the name of a dielectric part", "\"" + name + "\"",
                      known.empty() ? "the scene has none" : "the scene has: " + known});
}

bool is_environment(const Light& light) { return std::holds_alternative<EnvironmentLight>(light); }

bool has_size(const Light& light) {
    return std::holds_alternative<DiscLight>(light) || is_environment(light);
}

/// Light of the lamps alone.
ImageRgb render_lamps(Scene scene, const Camera& camera, const StimuliOptions& options,
                      std::uint64_t seed, const Progress& progress) {
    scene.ambient_radiance = Rgb::Zero();
    std::erase_if(scene.lights, is_environment);
    FinalOptions final;
    final.samples_per_pixel = options.samples_per_pixel;
    final.use_photons = options.use_photons;
    final.caustics.photon_count = options.photon_count;
    final.caustics.gather_radius_m = options.gather_radius_m;
    final.caustics.seed = seed;
    final.seed = seed;
    // Without photons a path finds a lamp through glass only after it left the table.
    final.paths.max_diffuse_bounces =
        options.use_photons ? options.diffuse_bounces : options.diffuse_bounces + 1;
    return render_image(RenderScene(std::move(scene)), camera, final, progress).radiance;
}

/// Light from all around alone: no bright spot to happen on, so nearly without noise.
ImageRgb render_surroundings(Scene scene, const Camera& camera, const StimuliOptions& options,
                             std::uint64_t seed, const Progress& progress) {
    std::erase_if(scene.lights, [](const Light& light) { return !is_environment(light); });
    if (scene.lights.empty() && (scene.ambient_radiance == 0.0f).all()) {
        return ImageRgb(camera.width, camera.height);
    }
    FinalOptions final;
    final.samples_per_pixel = options.samples_per_pixel;
    final.use_photons = false;
    final.seed = seed;
    final.paths.max_diffuse_bounces = options.diffuse_bounces + 1;
    return render_image(RenderScene(std::move(scene)), camera, final, progress).radiance;
}

Scene with_ior(const SeriesSpec& spec, double ior) {
    Scene scene = spec.scene;
    const std::size_t i = part_index(scene, spec.part, spec.title);
    std::get<Dielectric>(scene.parts[i].material).ior = ior;
    return scene;
}

double chosen_exposure(const std::vector<ImageRgb>& pictures) {
    std::vector<double> levels;
    for (const ImageRgb& picture : pictures) {
        for (const Rgb& pixel : picture) levels.push_back(luminance(pixel));
    }
    const double middle = median(std::move(levels));
    if (!(middle > 0)) {
        throw InputError({"scene", "light that reaches most of the picture", "black", ""});
    }
    return kMedianOnDisplay / middle;
}

double noise_of(const ImageRgb& a, const ImageRgb& b) {
    // |difference| / sqrt(2) is one picture's deviation; 99th percentile over pixels.
    std::vector<double> deviation;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const Rgb ca = a[i].max(0.0f).min(1.0f), cb = b[i].max(0.0f).min(1.0f);
        deviation.push_back(std::abs(lab_from_linear(ca).x() - lab_from_linear(cb).x()) /
                            std::sqrt(2.0));
    }
    return quantile(std::move(deviation), 0.99);
}

}  // namespace

void check_series(const SeriesSpec& spec, const std::string& where) {
    if (spec.scene.cameras.empty()) throw InputError({where, "a scene with a camera", "none", ""});
    part_index(spec.scene, spec.part, where);
    if (spec.ior.size() < 4 || spec.ior.size() > 40) {
        throw InputError({where, "4 to 40 refractive indices", std::to_string(spec.ior.size()),
                          "ten give the 210 trials of the paper"});
    }
    for (std::size_t i = 0; i < spec.ior.size(); ++i) {
        const bool is_rising = i == 0 || spec.ior[i] > spec.ior[i - 1];
        if (!(spec.ior[i] > 1.0 && spec.ior[i] <= 3.0) || !is_rising) {
            throw InputError({where, "rising refractive indices above 1 and up to 3",
                              std::to_string(spec.ior[i]), ""});
        }
    }
}

SeriesSpec read_series_spec(const fs::path& path) {
    const JsonObject root = read_json_file(path);
    root.choice("schema", {"vitrine.mlds_series/1"});
    SeriesSpec spec;
    spec.title = root.text_or("title", path.stem().string());
    spec.part = root.text("part");
    if (root.raw("ior").is_object()) {
        const JsonObject range = root.object("ior");
        const long long count = range.integer_or("count", 10);
        if (count < 4 || count > 40) range.fail("count", "4 to 40", std::to_string(count));
        spec.ior = equal_steps(range.number("from"), range.number("to"), static_cast<int>(count));
        range.finish();
    } else {
        spec.ior = root.numbers("ior");
    }
    spec.scene = read_scene(resolve_inside(root, "scene", path.parent_path()));
    root.finish();
    check_series(spec, path.string());
    return spec;
}

StimulusSeries render_stimuli(const SeriesSpec& spec, const fs::path& folder,
                              const StimuliOptions& options, const Progress& progress) {
    check_series(spec, spec.title);
    for (const Light& light : spec.scene.lights) {
        if (!options.use_photons && !has_size(light)) {
            throw InputError({spec.title, "lights with a size for --integrator path",
                              "a " + kind_name(light) + " light",
                              "no path finds a point through glass: use --integrator photon"});
        }
    }
    Camera camera = spec.scene.cameras.front();
    if (options.size_px > 0) camera = camera.scaled(options.size_px / double(camera.width));

    const std::size_t count = spec.ior.size();
    const auto render = [&](double ior, std::uint64_t seed, const Progress& part) {
        const Scene scene = with_ior(spec, ior);
        ImageRgb sum = render_lamps(scene, camera, options, seed, part.part(0.0, 0.7));
        const ImageRgb around =
            render_surroundings(scene, camera, options, seed, part.part(0.7, 1.0));
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += around[i];
        return sum;
    };
    std::vector<ImageRgb> pictures;
    const double share = 1.0 / static_cast<double>(count + 1);
    for (std::size_t i = 0; i < count; ++i) {
        const double at = share * static_cast<double>(i);
        pictures.push_back(render(spec.ior[i], options.seed, progress.part(at, at + share)));
    }
    ImageRgb repeated =
        render(spec.ior[count / 2], options.seed + 1, progress.part(1 - share, 1.0));

    StimulusSeries series;
    series.title = spec.title;
    series.ior = spec.ior;
    series.integrator = options.use_photons ? "photon" : "path";
    series.exposure = options.exposure > 0 ? options.exposure : chosen_exposure(pictures);
    const auto gain = static_cast<float>(series.exposure);
    for (Rgb& pixel : repeated) pixel *= gain;
    for (std::size_t i = 0; i < count; ++i) {
        for (Rgb& pixel : pictures[i]) pixel *= gain;
        const std::string stem = fmt::format("stimulus_{:02d}", i + 1);
        series.images.push_back(stem + ".png");
        series.linear.push_back(stem + ".exr");
        write_png(folder / series.images.back(), linear_to_srgb8(pictures[i]));
        write_exr(folder / series.linear.back(), pictures[i]);
    }
    series.noise_delta_l = noise_of(pictures[count / 2], repeated);
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
