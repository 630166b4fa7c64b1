#include "insert_quality.h"

#include "base/timer.h"
#include "compose/composite.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "insert_regions.h"
#include "lamp_glints.h"
#include "rerendered_truth.h"

#include <cstdio>

namespace vitrine {
namespace {
namespace fs = std::filesystem;

/// A sum over a region and its standard error, by how its tiles of 16 x 16 pixels differ: errors of
/// tiles are independent, those of neighbours are blurred into each other.
struct Sum {
    double value = 0, deviation = 0;
};
/// Of `term(i)` over the pixels of the region.
template <typename Term>
Sum sum_of(const Mask& region, const Term& term) {
    constexpr int kTile = 16;
    const int columns = (region.width() + kTile - 1) / kTile;
    const int rows = (region.height() + kTile - 1) / kTile;
    std::vector<double> tiles(static_cast<std::size_t>(columns * rows), 0.0);
    for (int y = 0; y < region.height(); ++y) {
        for (int x = 0; x < region.width(); ++x) {
            if (region(x, y) < 128) continue;
            tiles[static_cast<std::size_t>(y / kTile * columns + x / kTile)] +=
                term(static_cast<std::size_t>(y) * static_cast<std::size_t>(region.width()) +
                     static_cast<std::size_t>(x));
        }
    }
    Sum sum;
    double square = 0;
    for (const double tile : tiles) {
        sum.value += tile;
        square += tile * tile;
    }
    sum.deviation = std::sqrt(square);
    return sum;
}

/// Per region: the error, the truth's noise far off and how far the error is above it, and the same
/// with the truth's noise in the region: of both pictures, by their neighbours, less ours.
/// @param second another picture of ours, whose difference tells our noise; null: not known, left
/// in
void print_errors(const TrueFrame& frame, const char* name, const ImageRgb& d, double noise,
                  const ImageRgb& noise_variance, const ImageRgb* second) {
    std::printf("%s %s: error - floor far off = above it; - truth's noise in place%s = above it\n",
                frame.camera.id.c_str(), name, second ? "" : " (with ours)");
    for (int k = 0; k < 4; ++k) {
        const Mask& region = frame.regions[k];
        const RegionError e = region_error(frame.d_true, d, noise, noise_variance, region);
        double ours = 0;
        for (std::size_t i = 0; second && e.power > 0 && i < region.size(); ++i) {
            if (region[i] > 127) ours += 0.5 * (d[i] - (*second)[i]).square().sum() / e.power;
        }
        const double in_place = std::sqrt(std::max(0.0, e.noise * e.noise - ours));
        std::printf("    %-8s %.3f - %.3f = %.3f; - %.3f = %.3f\n", kRegionNames[k], e.error,
                    e.floor, e.error - e.floor, in_place, e.error - in_place);
    }
}

/// Two pictures of ours with different random numbers, and one of paths alone, tell whose the error
/// is: (first - truth) (second - truth) keeps what is not our noise, (first - truth) (second -
/// paths) what is neither of the noises, which is our bias.
/// @param window pixels in which the picture of paths is known
void print_shares(const TrueFrame& frame, const ImageRgb& first, const ImageRgb& second,
                  const ImageRgb* paths, const Mask& window) {
    const ImageRgb& truth = frame.d_true;
    for (int k = 0; k < 3; ++k) {
        Mask region = frame.regions[k];
        for (std::size_t i = 0; i < region.size(); ++i) region[i] = std::min(region[i], window[i]);
        const auto product = [&](const ImageRgb& a, const ImageRgb& b, const ImageRgb& c,
                                 const ImageRgb& d) {
            return sum_of(region,
                          [&](std::size_t i) { return ((a[i] - b[i]) * (c[i] - d[i])).sum(); });
        };
        const auto square = [&](const ImageRgb& a, const ImageRgb& b) {
            return sum_of(frame.regions[k],
                          [&](std::size_t i) { return (a[i] - b[i]).square().sum(); })
                .value;
        };
        const double power =
            sum_of(frame.regions[k], [&](std::size_t i) { return truth[i].square().sum(); }).value;
        const double error = square(first, truth), own = 0.5 * square(first, second);
        std::printf("%s whose error %s: all %.3f, our noise %.3f, without it %.3f",
                    frame.camera.id.c_str(), kRegionNames[k], std::sqrt(error / power),
                    std::sqrt(own / power), std::sqrt(std::max(0.0, error - own) / power));
        if (paths && count_inside(region) > 0) {
            const Sum here = product(first, truth, second, truth);
            const Sum bias = product(first, truth, second, *paths);
            std::printf(
                "; in the window, %.0f %% of the squared error: our bias %+.0f +- %.0f %% "
                "of that",
                100 * here.value / error, 100 * bias.value / here.value,
                100 * bias.deviation / here.value);
        }
        std::printf("\n");
    }
}

/// Mean change over the window, green, not clipped: deviations by the spread of pixels (truth) or
/// of paths.
void print_window(const RenderedImage& with, const RenderedImage& without,
                  const DifferentialImage& ours, const TrueFrame& frame,
                  const std::array<int, 4>& window) {
    double truth = 0, square = 0, own = 0, paths = 0, variance = 0;
    const double n = double(window[2]) * double(window[3]);
    for (int y = 0; y < window[3]; ++y) {
        for (int x = 0; x < window[2]; ++x) {
            const int u = window[0] + x, v = window[1] + y;
            const double change = frame.with(u, v)[1] - frame.plate(u, v)[1];
            truth += change / n;
            square += change * change / n;
            own += (ours.with(u, v)[1] - ours.without(u, v)[1]) / n;
            paths += (with.radiance(x, y)[1] - without.radiance(x, y)[1]) / n;
            variance += (with.variance(x, y) + without.variance(x, y)) / (n * n);
        }
    }
    std::printf("%s mean change in the window: truth %.4f +- %.4f, ours %.4f, paths %.4f +- %.4f\n",
                frame.camera.id.c_str(), truth, std::sqrt((square - truth * truth) / n), own, paths,
                std::sqrt(variance));
}

/// The change by paths alone: no photons, nothing averaged. Not clipped, since clipped noise is
/// darker noise; where the camera saturates, and outside of the window, ours stands for it.
/// @param window x, y, width, height
ImageRgb change_by_paths(const TruthScene& truth, const Part& part, const Camera& camera,
                         int samples, const std::array<int, 4>& window,
                         const DifferentialImage& ours, const TrueFrame& frame, float top) {
    FinalOptions options;
    options.samples_per_pixel = samples;
    options.use_photons = false;
    options.seed = 1000;
    Scene scene = truth.scene;
    scene.parts.push_back(part);
    scene.parts.back().is_virtual = false;
    const auto [x0, y0, width, height] = window;
    Camera part_of_it = camera;
    part_of_it.cx -= x0;
    part_of_it.cy -= y0;
    part_of_it.width = width;
    part_of_it.height = height;
    const RenderedImage with = render_image(RenderScene(scene), part_of_it, options);
    const RenderedImage without = render_image(RenderScene(truth.scene), part_of_it, options);
    ImageRgb change = raw_difference(ours.with, ours.without, top);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Rgb &a = ours.with(x0 + x, y0 + y), &b = ours.without(x0 + x, y0 + y);
            if (a.max(b).maxCoeff() >= 0.7f * top) continue;
            change(x0 + x, y0 + y) = with.radiance(x, y) - without.radiance(x, y);
        }
    }
    print_window(with, without, ours, frame, window);
    return gaussian_blur(change, kBlurPx);
}

/// Glints of the lamps within the object: what is there for certain, and what the truth's paths
/// found of it.
void print_glints(const TrueFrame& frame, const RenderScene& scene, const DifferentialImage& image,
                  const ImageRgb& d, const ImageRgb& noise_variance, float top) {
    const Mask& object = frame.regions[0];
    const ImageRgb lamps = lamps_in_glass(scene, frame.camera, object);
    Mask glints(object.width(), object.height());
    double certain = 0, in_truth = 0, in_ours = 0, quantum = 1e30;
    std::size_t count = 0, empty_true = 0;
    for (std::size_t i = 0; i < glints.size(); ++i) {
        if (object[i] < 128 || !(lamps[i][1] > 0.05f * top)) continue;
        glints[i] = 255;
        ++count;
        certain += lamps[i][1];
        const float base = frame.plate[i][1];
        in_truth += frame.with[i][1] - base;
        in_ours += image.with[i][1] - base;
        if (frame.with[i][1] > 2 * top) {
            quantum = std::min(quantum, double(frame.with[i][1] - base));
        } else {
            empty_true += frame.with[i][1] < base + 0.05f * top ? 1 : 0;
        }
    }
    if (count == 0 || quantum > 1e29) return;
    const Mask near_glint = dilate(glints, 6);
    Mask calm = object;
    double power = 0;
    for (std::size_t i = 0; i < calm.size(); ++i) {
        if (near_glint[i] > 127) calm[i] = 0;
        if (object[i] > 127) power += frame.d_true[i].square().sum();
    }
    const double noise = glint_noise(frame.plate, lamps, object, quantum, top, kBlurPx);
    std::printf(
        "%s glints: %zu pixels show a lamp by more than 5 %% of white when all branches are "
        "followed, %zu of them nothing in the truth; radiance summed: certain %.1f, ours %.1f, "
        "truth %.1f; least of a pixel that found one %.1f: paths of that worth make the truth's "
        "own error %.3f; off glints ours is %.3f\n",
        frame.camera.id.c_str(), count, empty_true, certain, in_ours, in_truth, quantum,
        noise / std::sqrt(power), region_error(frame.d_true, d, 0, noise_variance, calm).error);
}

}  // namespace

void compare_insertion(const RenderQualityOptions& options, const TruthScene& truth) {
    const fs::path folder = fs::path(options.capture) / "truth" / options.insert;
    if (!fs::exists(folder / "insert.json")) return;
    std::vector<Camera> cameras;
    for (const Camera& camera : truth.scene.cameras) {
        const bool is_there = fs::exists(folder / (camera.id + "_with.exr"));
        if (is_there && options.takes(camera.id)) cameras.push_back(camera);
    }
    if (cameras.empty()) return;
    const Part part = read_truth_insert(folder, options.object_crease_deg);
    const bool needs_second = options.has_second_seed || options.path_samples > 0;
    Timer timer;
    const DifferentialRenderer renderer(truth.scene, {part}, cameras, options.differential);
    std::optional<DifferentialRenderer> second;
    if (needs_second) {
        DifferentialOptions other = options.differential;
        ++other.seed;
        second.emplace(truth.scene, std::vector<Part>{part}, cameras, other);
    }
    std::printf("%s: photons %.1f s, met %.3f\n", options.insert.c_str(), timer.seconds(),
                static_cast<double>(renderer.photon_balance().met) /
                    static_cast<double>(renderer.photon_balance().shot));
    const auto top = static_cast<float>(truth.linear_scale);
    for (const Camera& camera : cameras) {
        const TrueFrame frame = read_frame(folder, camera, top);
        timer = Timer();
        const DifferentialImage image = renderer.render(camera);
        const double seconds = timer.seconds();
        const auto change_of = [&](const DifferentialImage& picture) {
            return gaussian_blur(raw_difference(picture.with, picture.without, top), kBlurPx);
        };
        const ImageRgb picture = composite(frame.plate, image);
        const ImageRgb d_render = change_of(image);
        const ImageRgb d_composite =
            gaussian_blur(raw_difference(picture, frame.plate, top), kBlurPx);
        ImageRgb raw_error = raw_difference(image.with, image.without, top);
        for (std::size_t i = 0; i < raw_error.size(); ++i) raw_error[i] -= frame.raw_true[i];
        const ImageRgb noise_variance = blurred_noise_variance(raw_error);
        const FarNoise noise = far_noise(frame.d_true, frame.raw_true, d_render, frame.level);
        std::optional<ImageRgb> d_second;
        if (second) d_second = change_of(second->render(camera));
        const ImageRgb* other = d_second ? &*d_second : nullptr;
        print_errors(frame, "rendered", d_render, noise.rms, noise_variance, other);
        print_errors(frame, "composite", d_composite, noise.rms, noise_variance, other);
        std::printf("%s truth's noise far off: by neighbours %.2f of what it is\n",
                    camera.id.c_str(), noise.by_neighbours / std::max(1e-30, noise.rms));
        if (second) {
            std::optional<ImageRgb> paths;
            std::array<int, 4> window = {0, 0, camera.width, camera.height};
            if (options.window.size() == 4) std::copy_n(options.window.begin(), 4, window.begin());
            Mask in_window(camera.width, camera.height);
            // What the blur brings in from outside is ours.
            constexpr int kMargin = 6;
            for (int y = window[1] + kMargin; y < window[1] + window[3] - kMargin; ++y) {
                for (int x = window[0] + kMargin; x < window[0] + window[2] - kMargin; ++x) {
                    in_window(x, y) = 255;
                }
            }
            if (options.path_samples > 0) {
                paths = change_by_paths(truth, part, camera, options.path_samples, window, image,
                                        frame, top);
                if (!options.rerendered.empty()) {
                    compare_rerendered(options.rerendered, frame, "paths", *paths, nullptr, top);
                }
            }
            print_shares(frame, d_render, *d_second, paths ? &*paths : nullptr, in_window);
        }
        if (!options.rerendered.empty()) {
            compare_rerendered(options.rerendered, frame, "ours", d_render, other, top);
        }
        if (std::holds_alternative<Dielectric>(part.material)) {
            print_glints(frame, renderer.scene(), image, d_render, noise_variance, top);
        }
        std::printf("%s rendered in %.1f s\n", camera.id.c_str(), seconds);
        std::fflush(stdout);
        if (options.out.empty()) continue;
        const fs::path out = options.out;
        const std::string stem = camera.id + "_" + options.insert;
        write_side_by_side(out / (stem + ".png"), {picture, frame.with}, truth.linear_scale);
        ImageRgb error(frame.plate.width(), frame.plate.height());
        for (std::size_t i = 0; i < error.size(); ++i) {
            error[i] = 0.5f * top + 4.0f * (d_composite[i] - frame.d_true[i]);
        }
        write_side_by_side(out / (stem + "_error.png"), {error}, truth.linear_scale);
        write_composite_exr(out / (stem + ".exr"), frame.plate, image, camera);
        write_exr(out / (stem + "_with.exr"), image.with, {.half = false});
        write_exr(out / (stem + "_without.exr"), image.without, {.half = false});
    }
}

}  // namespace vitrine
