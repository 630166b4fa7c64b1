// vitrine_insertion_errors SCENE.json INSERTION.json: how far a finished frame with a virtual
// object is from what many more paths make of it.
//
// SCENE.json is the 40_scene/scene.json of a workspace. The frame is rendered as `vitrine insert`
// does, and once more with other random numbers and 64 to 1024 paths a pixel; both are composed
// with one plate, the latter's picture without the object. Printed is the root mean square of what
// differs as displayed (sRGB, 0 to 1), pixel by pixel and of the means over 4 x 4 pixels, on the
// virtual object, where it changes the picture much (its shadow, caustics) and where it changes it
// little.
#include "compose/composite.h"
#include "differential_options.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "scene/insertion.h"

#include <CLI/CLI.hpp>

#include <ctime>

namespace vitrine {
namespace {

struct Options {
    std::string scene, insertion, out;
    std::size_t camera = 3;
    double scale = 1, white = 1.25;
    DifferentialOptions render;
    int reference_min_samples = 64, reference_max_samples = 1024;
    double reference_noise_target = 0.001;
};

/// Of the displayed change: what is seen at a glance.
constexpr float kStrong = 0.03f;
constexpr float kFaint = 0.002f;
constexpr int kBlockPx = 4;

ImageRgb displayed(const ImageRgb& linear, double white) {
    ImageRgb shown(linear.width(), linear.height());
    for (std::size_t i = 0; i < shown.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            shown[i][c] = linear_to_srgb(linear[i][c] / static_cast<float>(white));
        }
    }
    return shown;
}

DifferentialImage render(const Options& options, const Scene& real, const Insertion& insertion,
                         const DifferentialOptions& how, const char* name) {
    const Camera camera = real.cameras.at(options.camera).scaled(options.scale);
    const std::clock_t start = std::clock();
    const DifferentialRenderer renderer(real, insertion.objects, std::span(&camera, 1), how);
    DifferentialImage image = renderer.render(camera);
    std::printf("%s: %dx%d, %.1f CPU s\n", name, camera.width, camera.height,
                static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    std::fflush(stdout);
    if (!options.out.empty()) {
        std::filesystem::create_directories(options.out);
        write_exr(std::filesystem::path(options.out) / (std::string(name) + ".exr"), image.with);
    }
    return image;
}

/// Root mean square over the blocks of `side` pixels that lie within the region.
double rms(const ImageRgb& error, const Mask& region, int side) {
    double sum = 0, count = 0;
    for (int y = 0; y + side <= error.height(); y += side) {
        for (int x = 0; x + side <= error.width(); x += side) {
            Rgb mean = Rgb::Zero();
            bool is_within = true;
            for (int k = 0; k < side * side; ++k) {
                const int u = x + k % side, v = y + k / side;
                is_within &= region(u, v) > 127;
                mean += error(u, v) / static_cast<float>(side * side);
            }
            if (!is_within) continue;
            sum += mean.square().sum();
            count += 3;
        }
    }
    return count > 0 ? std::sqrt(sum / count) : 0;
}

void compare(const Options& options, const DifferentialImage& image,
             const DifferentialImage& reference) {
    const ImageRgb& plate = reference.without;
    const ImageRgb shown = displayed(composite(plate, image), options.white);
    const ImageRgb true_with = displayed(composite(plate, reference), options.white);
    const ImageRgb true_without = displayed(plate, options.white);
    const int width = shown.width(), height = shown.height();
    ImageRgb error(width, height), change(width, height);
    for (std::size_t i = 0; i < error.size(); ++i) {
        error[i] = shown[i] - true_with[i];
        change[i] = (true_with[i] - true_without[i]).abs();
    }
    change = gaussian_blur(change, 2.0);
    Mask object(width, height), strong(width, height), faint(width, height);
    for (std::size_t i = 0; i < error.size(); ++i) {
        const float c = change[i].maxCoeff(), covered = reference.coverage[i];
        object[i] = covered >= 1 ? 255 : 0;
        strong[i] = covered <= 0 && c >= kStrong ? 255 : 0;
        faint[i] = covered <= 0 && c < kStrong && c >= kFaint ? 255 : 0;
    }
    const auto line = [&](const char* name, const Mask& region) {
        std::printf("%-28s %7zu px  rms %.4f  of 4x4 means %.4f\n", name, count_inside(region),
                    rms(error, region, 1), rms(error, region, kBlockPx));
    };
    line("object", object);
    line("shadow, caustic (> 0.03)", strong);
    line("faint changes (> 0.002)", faint);
}

int run(int argc, char** argv) {
    Options options;
    CLI::App app("Error of a finished frame against one of many more paths");
    app.add_option("scene", options.scene, "40_scene/scene.json of a workspace")->required();
    app.add_option("insertion", options.insertion, "insertion.json")->required();
    app.add_option("--camera", options.camera, "Number of the camera");
    app.add_option("--scale", options.scale, "Of the frame, to the camera's size");
    app.add_option("--white", options.white, "Radiance shown as white");
    app.add_option("--samples", options.render.min_samples, "See DifferentialOptions");
    add_differential_options(app, options.render);
    app.add_option("--reference-samples", options.reference_min_samples, "Paths, at least");
    app.add_option("--reference-max-samples", options.reference_max_samples, "Paths, at most");
    app.add_option("--reference-noise-target", options.reference_noise_target,
                   "See DifferentialOptions");
    app.add_option("--out", options.out, "Write both pictures here");
    CLI11_PARSE(app, argc, argv);
    const Scene real = read_scene(options.scene);
    const Insertion insertion = read_insertion(options.insertion);
    DifferentialOptions reference = options.render;
    reference.seed = options.render.seed + 1;
    reference.min_samples = options.reference_min_samples;
    reference.min_soft_samples = options.reference_min_samples / 2;
    reference.max_samples = options.reference_max_samples;
    reference.noise_target = options.reference_noise_target;
    const DifferentialImage image = render(options, real, insertion, options.render, "frame");
    compare(options, image, render(options, real, insertion, reference, "reference"));
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
