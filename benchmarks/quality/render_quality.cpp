// vitrine_render_quality: renders the true scene of a synthetic capture, with and without its
// virtual object, and compares with the pictures that another renderer made of it.
#include "base/json_reader.h"
#include "base/timer.h"
#include "compose/composite.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "plain_quality.h"

#include <CLI/CLI.hpp>

#include <cstdio>

namespace vitrine {
namespace {
namespace fs = std::filesystem;

Rgb clipped(const Rgb& v, float top) { return v.max(0.0f).min(top); }

constexpr double kBlurPx = 2.0;

/// Clipped as the camera does, then with - without.
ImageRgb raw_difference(const ImageRgb& with, const ImageRgb& without, float top) {
    ImageRgb d(with.width(), with.height());
    for (std::size_t i = 0; i < d.size(); ++i) {
        d[i] = clipped(with[i], top) - clipped(without[i], top);
    }
    return d;
}

/// Variance of the pixel noise of `error`, from how each pixel differs from its four neighbours
/// (what is smooth drops out), and what the blur leaves of it.
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

struct RegionError {
    double error = 0;
    double floor = 0;  ///< the truth's noise far from any change
    double noise = 0;  ///< that of both pictures within the region
    std::size_t count = 0;
};

template <typename Inside>
RegionError region_error(const ImageRgb& truth, const ImageRgb& estimate, double noise_rms,
                         const ImageRgb& noise_variance, const Inside& inside) {
    double difference = 0, power = 0, noise = 0;
    RegionError result;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (!inside(i)) continue;
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

/// Root mean square of the true difference where the estimate says that nothing changed.
double noise_rms(const ImageRgb& truth, const ImageRgb& estimate, double level) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (estimate[i].abs().maxCoeff() > 0.002 * level) continue;
        sum += truth[i].square().sum();
        count += 3;
    }
    return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0;
}

void compare_insertion(const RenderQualityOptions& options, const TruthScene& truth) {
    const fs::path folder = fs::path(options.capture) / "truth" / options.insert;
    if (!fs::exists(folder / "insert.json")) return;
    std::vector<Camera> cameras;
    for (const Camera& camera : truth.scene.cameras) {
        const bool is_there = fs::exists(folder / (camera.id + "_with.exr"));
        if (is_there && options.takes(camera.id)) cameras.push_back(camera);
    }
    if (cameras.empty()) return;
    Timer timer;
    const DifferentialRenderer renderer(truth.scene,
                                        {read_truth_insert(folder, options.object_crease_deg)},
                                        cameras, options.differential);
    std::optional<DifferentialRenderer> second;
    if (options.has_second_seed) {
        DifferentialOptions other = options.differential;
        ++other.seed;
        second.emplace(truth.scene,
                       std::vector<Part>{read_truth_insert(folder, options.object_crease_deg)},
                       cameras, other);
    }
    std::printf("%s: photons %.1f s, met %.3f\n", options.insert.c_str(), timer.seconds(),
                static_cast<double>(renderer.photon_balance().met) /
                    static_cast<double>(renderer.photon_balance().shot));
    for (const Camera& camera : cameras) {
        const ImageRgb plate = read_exr_rgb(folder / ".." / "linear" / (camera.id + ".exr"));
        const ImageRgb with = read_exr_rgb(folder / (camera.id + "_with.exr"));
        timer = Timer();
        const DifferentialImage image = renderer.render(camera);
        const double seconds = timer.seconds();
        const auto top = static_cast<float>(truth.linear_scale);
        const ImageRgb picture = composite(plate, image);
        const ImageRgb raw_true = raw_difference(with, plate, top);
        const ImageRgb raw_render = raw_difference(image.with, image.without, top);
        const ImageRgb d_true = gaussian_blur(raw_true, kBlurPx);
        const ImageRgb d_render = gaussian_blur(raw_render, kBlurPx);
        const ImageRgb d_composite = gaussian_blur(raw_difference(picture, plate, top), kBlurPx);
        ImageRgb raw_error = raw_render;
        for (std::size_t i = 0; i < raw_error.size(); ++i) raw_error[i] -= raw_true[i];
        const ImageRgb noise_variance = blurred_noise_variance(raw_error);
        double level = 0;
        for (const Rgb& p : plate) level += clipped(p, top).mean();
        level /= static_cast<double>(plate.size());
        const Mask virtual_mask = read_mask(folder / (camera.id + "_virtual_mask.png"));
        const Mask object = erode(virtual_mask, 2), around = dilate(virtual_mask, 4);
        const double noise = noise_rms(d_true, d_render, level);
        const auto is_changed = [&](std::size_t i) {
            return around[i] < 128 && d_true[i].abs().maxCoeff() > 0.02 * level;
        };
        for (const auto* d : {&d_render, &d_composite}) {
            // Glints of the lamp in glass are a few saturated pixels, undersampled in the truth.
            const auto is_glint = [&](std::size_t i) {
                return std::max(with[i].maxCoeff(), image.with[i].maxCoeff()) > top;
            };
            Mask glints(plate.width(), plate.height());
            for (std::size_t i = 0; i < glints.size(); ++i) glints[i] = is_glint(i) ? 255 : 0;
            const Mask near_glint = dilate(glints, 6);
            const RegionError calm =
                region_error(d_true, *d, noise, noise_variance,
                             [&](std::size_t i) { return object[i] > 127 && near_glint[i] < 128; });
            const RegionError e[4] = {
                region_error(d_true, *d, noise, noise_variance,
                             [&](std::size_t i) { return object[i] > 127; }),
                region_error(d_true, *d, noise, noise_variance,
                             [&](std::size_t i) { return is_changed(i) && d_true[i].sum() < 0; }),
                region_error(d_true, *d, noise, noise_variance,
                             [&](std::size_t i) { return is_changed(i) && d_true[i].sum() > 0; }),
                region_error(d_true, *d, noise, noise_variance, [&](std::size_t) { return true; })};
            std::printf("%s %s %s: error (floor far off, noise in place)", camera.id.c_str(),
                        options.insert.c_str(), d == &d_render ? "rendered " : "composite");
            const char* names[4] = {"object", "darker", "brighter", "all"};
            for (std::size_t k = 0; k < 4; ++k) {
                std::printf("  %s %.3f (%.3f, %.3f)", names[k], e[k].error, e[k].floor, e[k].noise);
            }
            std::printf("  object off glints %.3f  %.1f s\n", calm.error, seconds);
        }
        if (second) {
            const DifferentialImage twin = second->render(camera);
            // Of one picture: half the variance of the difference of two.
            ImageRgb off = gaussian_blur(raw_difference(twin.with, twin.without, top), kBlurPx);
            for (std::size_t i = 0; i < off.size(); ++i) {
                off[i] = d_true[i] + (off[i] - d_render[i]) * std::sqrt(0.5f);
            }
            const auto own = [&](const auto& inside) {
                return region_error(d_true, off, 0, noise_variance, inside).error;
            };
            std::printf("%s %s our own noise: object %.3f darker %.3f brighter %.3f\n",
                        camera.id.c_str(), options.insert.c_str(),
                        own([&](std::size_t i) { return object[i] > 127; }),
                        own([&](std::size_t i) { return is_changed(i) && d_true[i].sum() < 0; }),
                        own([&](std::size_t i) { return is_changed(i) && d_true[i].sum() > 0; }));
        }
        std::fflush(stdout);
        if (options.out.empty()) continue;
        const fs::path out = options.out;
        const std::string stem = camera.id + "_" + options.insert;
        write_side_by_side(out / (stem + ".png"), {picture, with}, truth.linear_scale);
        ImageRgb error(plate.width(), plate.height());
        for (std::size_t i = 0; i < error.size(); ++i) {
            error[i] = 0.5f * top + 4.0f * (d_composite[i] - d_true[i]);
        }
        write_side_by_side(out / (stem + "_error.png"), {error}, truth.linear_scale);
        write_composite_exr(out / (stem + ".exr"), plate, image, camera);
    }
}

int run(int argc, char** argv) {
    RenderQualityOptions options;
    bool skip_plain = false;
    CLI::App app("Compare our renders of a capture's true scene with its true pictures");
    app.add_option("capture", options.capture, "Capture folder with truth/")->required();
    app.add_option("--insert", options.insert, "Folder of the insertion's truth");
    app.add_option("--frames", options.frames, "Ids of the frames to look at; default all");
    app.add_option("--out", options.out, "Write pictures here");
    app.add_option("--samples", options.samples,
                   "Samples per pixel of the plain renders, at least");
    app.add_option("--photon-count", options.differential.photon_count, "Photons shot");
    app.add_option("--noise-target", options.differential.noise_target, "See DifferentialOptions");
    app.add_option("--max-samples", options.differential.max_samples, "See DifferentialOptions");
    app.add_option("--crease-deg", options.crease_deg, "Smooth the real parts below this angle");
    app.add_option("--object-crease-deg", options.object_crease_deg,
                   "Smooth the virtual object below this angle");
    app.add_flag("--second-seed", options.has_second_seed,
                 "Insert twice: what differs is our own noise");
    app.add_flag("--skip-plain", skip_plain, "Insertion alone");
    CLI11_PARSE(app, argc, argv);
    if (!options.out.empty()) fs::create_directories(options.out);
    const TruthScene truth = read_truth(options.capture, options.crease_deg);
    if (!skip_plain) {
        const RenderScene scene(truth.scene);
        CausticOptions caustics;
        caustics.photon_count = options.differential.photon_count;
        caustics.gather_radius_m = pixel_radius(scene, truth.scene.cameras.front());
        Timer timer;
        const CausticPhotons photons = trace_caustics(scene, caustics);
        std::printf("photons: shot %llu met %llu stored %zu  %.2f s; radius %.2f mm\n",
                    static_cast<unsigned long long>(photons.balance.shot),
                    static_cast<unsigned long long>(photons.balance.met), photons.photons.size(),
                    timer.seconds(), 1e3 * caustics.gather_radius_m);
        const CausticMaps maps = build_caustic_maps(photons.photons, caustics.gather_radius_m);
        std::printf("maps: sharp %zu soft %zu wide %zu  %.2f s\n", maps.sharp.size(),
                    maps.soft.size(), maps.wide.size(), timer.seconds());
        compare_plain(options, truth, scene, maps);
    }
    compare_insertion(options, truth);
    return 0;
}

}  // namespace
}  // namespace vitrine

int main(int argc, char** argv) {
    try {
        return vitrine::run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
