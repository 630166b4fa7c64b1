#include "base/file.h"
#include "command.h"
#include "commands.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "render/render_image.h"

#include <filesystem>

namespace vitrine::cli {
namespace {

struct RenderArguments {
    std::string scene, out, camera, method = "photons";
    double resolution = 1.0, white = 1.0;
    FinalOptions options = picture_options();
};

void declare(CLI::App& command, RenderArguments& a) {
    command.add_option("scene", a.scene, "Scene file (vitrine.scene/1)")
        ->required()
        ->group("Input");
    command.add_option("--camera", a.camera, "Id of the one camera to render; default all")
        ->group("Input");
    command.add_option("--out", a.out, "Folder for <camera>.exr (linear) and <camera>.png")
        ->required()
        ->group("Output");
    command.add_option("--white", a.white, "Radiance that the PNG shows as white")
        ->check(CLI::PositiveNumber)
        ->group("Output");
    command.add_option("--resolution", a.resolution, "Scales width and height of every camera")
        ->check(CLI::Range(0.01, 16.0))
        ->group("Output");
    command.add_option("--method", a.method, "photons, or paths: the slow reference")
        ->check(CLI::IsMember({"photons", "paths"}))
        ->group("Quality");
    command
        .add_option("--samples-per-pixel", a.options.samples_per_pixel,
                    "Paths per pixel, everywhere")
        ->check(CLI::Range(1, 1 << 20))
        ->group("Quality");
    command
        .add_option("--max-samples-per-pixel", a.options.max_samples_per_pixel,
                    "Paths per pixel where the picture is noisy; 0: no more than everywhere")
        ->check(CLI::Range(0, 1 << 20))
        ->group("Quality");
    command
        .add_option("--noise-target", a.options.noise_target,
                    "Standard error to reach there, as a share of the pixel's level")
        ->check(CLI::PositiveNumber)
        ->group("Quality");
    command
        .add_option("--soft-samples-per-pixel", a.options.soft_samples_per_pixel,
                    "Paths per pixel that look for light from other surfaces, whose mean is taken "
                    "over neighbours; 0: all do, and no mean is taken")
        ->check(CLI::Range(0.0, 1e6))
        ->group("Quality");
    command.add_option("--photon-count", a.options.caustics.photon_count, "Photons shot")
        ->check(CLI::Range(1, 200'000'000))
        ->group("Quality");
    command
        .add_option("--gather-radius-m", a.options.caustics.gather_radius_m,
                    "Radius within which the first photons are gathered, later ones within less; "
                    "0: half a pixel's width")
        ->check(CLI::Range(0.0, 10.0))
        ->group("Quality");
    command
        .add_option("--max-diffuse-bounces", a.options.paths.max_diffuse_bounces,
                    "Times that light is scattered on")
        ->check(CLI::Range(0, 1000))
        ->group("Quality");
}

}  // namespace

void add_render_command(CLI::App& root) {
    CLI::App* command = root.add_subcommand("render", "Render a scene file");
    auto a = std::make_shared<RenderArguments>();
    declare(*command, *a);
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        const Scene scene = read_scene(a->scene);
        FinalOptions options = a->options;
        options.use_photons = a->method == "photons";
        if (!options.use_photons) options.soft_samples_per_pixel = 0;
        options.seed = options.caustics.seed = common->seed;
        std::vector<Camera> cameras;
        for (const Camera& camera : scene.cameras) {
            if (a->camera.empty() || camera.id == a->camera) {
                cameras.push_back(camera.scaled(a->resolution));
            }
        }
        if (cameras.empty()) {
            throw InputError({a->scene, a->camera.empty() ? "a camera" : "camera " + a->camera,
                              fmt::format("{} other cameras", scene.cameras.size()), ""});
        }
        std::filesystem::create_directories(a->out);
        const RenderScene prepared(scene);
        const Progress progress = make_progress(*common, "render");
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            const double n = static_cast<double>(cameras.size());
            const RenderedImage image = render_image(
                prepared, cameras[i], options, progress.part(double(i) / n, double(i + 1) / n));
            const std::filesystem::path stem = std::filesystem::path(a->out) / cameras[i].id;
            write_exr(stem.string() + ".exr", image.radiance);
            write_png(stem.string() + ".png",
                      linear_to_srgb8(image.radiance, static_cast<float>(1.0 / a->white)));
            fmt::print("{}.exr\n{}.png\n", stem.string(), stem.string());
        }
        return kDone;
    });
}

}  // namespace vitrine::cli
