// vitrine_reference_caustic: renders the canonical caustic and compares with its converged
// pictures: levels, energy, error of the caustic seen directly and through the glass, and what
// that costs in CPU seconds of the whole program.
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "reference_scene.h"
#include "render/render_image.h"
#include "sphere_caustic.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <ctime>

namespace vitrine {
namespace {
namespace fs = std::filesystem;

struct Options {
    std::string folder, out;
    std::vector<int> cameras = {0, 1, 2, 3};
    std::vector<std::uint64_t> photon_counts = {20'000'000};
    int sphere_rings = 96;
    FinalOptions render = picture_options();
};

/// The reference leaves out light that the caustic scatters on, which weighs below this radiance.
constexpr float kDarkest = 0.03f;

/// Of the picture of the relative error: grey is zero, white +25 %.
constexpr float kErrorGain = 2.0f;

/// Pixels by what they see at their centre.
struct Regions {
    Mask table;   ///< D: table seen directly around shadow and caustic
    Mask sphere;  ///< S: inside of the glass ball's silhouette
    Mask shadow;  ///< D where the ball hides the lamp: all light is the caustic's
};

Regions find_regions(const ReferenceScene& reference, const RenderScene& scene,
                     const Camera& camera) {
    Regions regions{Mask(camera.width, camera.height), Mask(camera.width, camera.height),
                    Mask(camera.width, camera.height)};
    const Geometry geometry = render_geometry(scene, camera);
    const Vec3f lamp =
        std::get<PointLight>(reference.scene.lights.front()).position_m.cast<float>();
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const auto part = static_cast<std::size_t>(geometry.part(x, y));
            if (part == reference.sphere) regions.sphere(x, y) = 255;
            if (part != reference.table) continue;
            const Vec3 p = camera.unproject(x, y, geometry.z_m(x, y));
            if (p.x() < -0.16 || p.x() > 0.02 || p.y() < -0.02 || p.y() > 0.15) continue;
            regions.table(x, y) = 255;
            const Vec3f start = p.cast<float>() + Vec3f(0, 0, 1e-4f);
            if (scene.accel().is_occluded({start, lamp - start, 0.0f, 1.0f, kAllParts})) {
                regions.shadow(x, y) = 255;
            }
        }
    }
    for (Mask* mask : {&regions.table, &regions.sphere, &regions.shadow}) *mask = erode(*mask, 2);
    return regions;
}

struct Error {
    double relative = 0;    ///< relMSE = mean((a - b)^2 / (b^2 + 0.01 mean(b)^2))
    double normalised = 0;  ///< nMSE = mean((a - b)^2) / mean(b^2)
    double energy = 0;      ///< sum(a) / sum(b)
};

Error compare(const ImageRgb& image, const ImageRgb& reference, const Mask& region,
              float darkest = 0) {
    double mean = 0, square = 0, difference = 0, sum = 0, count = 0;
    const auto visit = [&](const auto& body) {
        for (std::size_t i = 0; i < region.size(); ++i) {
            if (region[i] < 128 || reference[i][1] < darkest) continue;
            for (int c = 0; c < 3; ++c) body(double(image[i][c]), double(reference[i][c]));
        }
    };
    visit([&](double a, double b) {
        mean += b;
        square += b * b;
        difference += (a - b) * (a - b);
        sum += a;
        ++count;
    });
    Error error;
    if (count == 0) return error;
    error.energy = sum / mean;
    error.normalised = difference / square;
    mean /= count;
    visit([&](double a, double b) {
        error.relative += (a - b) * (a - b) / (b * b + 0.01 * mean * mean) / count;
    });
    return error;
}

/// Ratio of levels and share of the relative error by brightness of the reference.
void print_bins(const ImageRgb& image, const ImageRgb& reference, const Mask& region) {
    std::printf("  D by radiance:");
    for (float low = kDarkest; low < 40.0f; low *= 2) {
        Mask bin(region.width(), region.height());
        for (std::size_t i = 0; i < bin.size(); ++i) {
            const bool is_in = reference[i][1] >= low && reference[i][1] < 2 * low;
            bin[i] = is_in ? region[i] : 0;
        }
        const Error e = compare(image, reference, bin);
        if (count_inside(bin) == 0) continue;
        std::printf("  %.2f: %zu px, level %.4f, nMSE %.5f", double(low), count_inside(bin),
                    e.energy, e.normalised);
    }
    std::printf("\n");
}

/// The pixel that weighs most in the relative error of the region.
/// @param exact the caustic alone, counted: in the lamp's shadow there is little else
void print_worst(const ImageRgb& image, const ImageRgb& reference, const Mask& region,
                 const ImageF& exact) {
    Mask rest = region;
    double mean = 0;
    const auto is_used = [&](std::size_t i) {
        return rest[i] > 127 && reference[i][1] >= kDarkest;
    };
    for (std::size_t i = 0; i < rest.size(); ++i) {
        if (is_used(i)) mean += reference[i].mean();
    }
    mean /= std::max(1.0, static_cast<double>(count_inside(region)));
    std::size_t worst = 0;
    double most = -1;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        if (!is_used(i)) continue;
        const double b = reference[i].mean(), d = image[i].mean() - b;
        const double error = d * d / (b * b + 0.01 * mean * mean);
        if (error <= most) continue;
        most = error;
        worst = i;
    }
    if (most < 0) return;
    rest[worst] = 0;
    const auto width = static_cast<std::size_t>(image.width());
    std::printf(
        "  worst pixel (%zu, %zu): %.4f, reference %.4f, caustic alone by counting %.4f; D without "
        "it relMSE %.5f\n",
        worst % width, worst / width, double(image[worst].mean()), double(reference[worst].mean()),
        double(exact[worst]), compare(image, reference, rest, kDarkest).relative);
}

/// Ours and the reference beside the counted caustic, where that is bright and all the light there
/// is, but for what other surfaces scatter.
void print_counted(const ImageRgb& image, const ImageRgb& reference, const ImageF& exact,
                   const Mask& region) {
    constexpr float kBright = 0.5f;
    Mask bright = region;
    ImageRgb counted(exact.width(), exact.height());
    for (std::size_t i = 0; i < exact.size(); ++i) {
        counted[i] = Rgb::Constant(exact[i]);
        if (exact[i] < kBright) bright[i] = 0;
    }
    std::printf(
        "  %zu bright pixels of the shadow, against counting: relMSE of ours %.5f, of the "
        "reference %.5f\n",
        count_inside(bright), compare(image, counted, bright).relative,
        compare(reference, counted, bright).relative);
}

/// A pixel of the open table: our picture, direct light alone in closed form (what the other
/// renderers were checked with), the reference with its interreflection's noise.
void print_check_pixel(const ImageRgb& image, const ImageRgb& reference, const Scene& scene,
                       const Camera& camera, int x, int y) {
    const Vec3 eye = camera.centre_in_world(), ray = camera.ray_in_world(x, y);
    const Vec3 place = eye - ray * (eye.z() / ray.z());
    const auto& lamp = std::get<PointLight>(scene.lights.front());
    const Vec3 to_lamp = lamp.position_m - place;
    const double albedo = std::get<Diffuse>(scene.parts.front().material).albedo.mean();
    const double direct =
        albedo / kPi * lamp.intensity_w_per_sr.mean() * to_lamp.z() / std::pow(to_lamp.norm(), 3);
    const double ours = image(x, y).mean();
    std::printf(
        "  check pixel (%d, %d): %.7f; direct light %.7f, ratio %.4f; reference %.7f, ratio "
        "%.4f\n",
        x, y, ours, direct, ours / direct, double(reference(x, y).mean()),
        ours / reference(x, y).mean());
}

void write_error(const fs::path& path, const ImageRgb& image, const ImageRgb& reference) {
    ImageRgb relative(image.width(), image.height());
    for (std::size_t i = 0; i < relative.size(); ++i) {
        relative[i] = 0.5f + kErrorGain * (image[i] - reference[i]) / reference[i].max(0.003f);
    }
    write_png(path, linear_to_srgb8(relative));
}

void measure(const Options& options, int number, std::uint64_t photon_count) {
    const std::clock_t start = std::clock();
    const ReferenceScene reference = read_reference_scene(options.folder, options.sphere_rings);
    const RenderScene scene(reference.scene);
    const Camera& camera = reference.scene.cameras.at(static_cast<std::size_t>(number));
    FinalOptions render = options.render;
    render.caustics.photon_count = photon_count;
    const ImageRgb image = render_image(scene, camera, render).radiance;
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;

    const ImageRgb truth = read_exr_rgb(reference.pictures.at(static_cast<std::size_t>(number)));
    const Regions regions = find_regions(reference, scene, camera);
    const Error d = compare(image, truth, regions.table, kDarkest);
    const Error s = compare(image, truth, regions.sphere);
    const Error core = compare(image, truth, regions.shadow, kDarkest);
    std::printf(
        "camera %d, %llu photons, %d samples: D relMSE %.5f nMSE %.5f  caustic energy %.4f  "
        "inside sphere relMSE %.5f (energy %.4f)  %.2f CPU s\n",
        number, static_cast<unsigned long long>(photon_count), render.samples_per_pixel, d.relative,
        d.normalised, core.energy, s.relative, s.energy, seconds);
    if (number == 0) print_check_pixel(image, truth, reference.scene, camera, 150, 250);
    if (number >= 2) {
        print_bins(image, truth, regions.table);
        const ImageF exact = sphere_caustic(reference, camera);
        print_worst(image, truth, regions.table, exact);
        print_counted(image, truth, exact, regions.shadow);
    }
    if (number == 2) print_check_pixel(image, truth, reference.scene, camera, 100, 300);
    std::fflush(stdout);
    if (options.out.empty()) return;
    fs::create_directories(options.out);
    const std::string stem = "camera" + std::to_string(number);
    write_exr(fs::path(options.out) / (stem + ".exr"), image);
    write_error(fs::path(options.out) / (stem + "_relative_error.png"), image, truth);
}

int run(int argc, char** argv) {
    Options options;
    CLI::App app("Compare our render of the canonical caustic with its converged pictures");
    app.add_option("folder", options.folder, "Folder with ground_truth.json and the pictures")
        ->required();
    app.add_option("--cameras", options.cameras, "Numbers of the cameras");
    app.add_option("--photon-count", options.photon_counts, "Photons shot; several: one run each");
    app.add_option("--samples-per-pixel", options.render.samples_per_pixel, "Paths per pixel");
    app.add_option("--max-samples-per-pixel", options.render.max_samples_per_pixel,
                   "Where the picture is noisy");
    app.add_option("--noise-target", options.render.noise_target, "See FinalOptions");
    app.add_option("--soft-samples-per-pixel", options.render.soft_samples_per_pixel,
                   "See FinalOptions");
    app.add_option("--pass-photon-count", options.render.pass_photon_count, "See FinalOptions");
    app.add_option("--gather-radius-m", options.render.caustics.gather_radius_m,
                   "0: half a pixel's width");
    app.add_option("--sphere-rings", options.sphere_rings, "The ball has 4 rings^2 triangles");
    app.add_option("--seed", options.render.seed, "Of photons and paths");
    app.add_option("--out", options.out, "Write pictures here");
    CLI11_PARSE(app, argc, argv);
    options.render.caustics.seed = options.render.seed;
    for (const std::uint64_t photon_count : options.photon_counts) {
        for (const int camera : options.cameras) measure(options, camera, photon_count);
    }
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
