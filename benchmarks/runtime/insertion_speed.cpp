// vitrine_insertion_speed SCENE.json INSERTION.json [--final]: the two modes of inserting.
//
// Preview: seconds from moving the virtual object to a new 640x360 frame, with the unmoved world
// kept. --final: a frame of 1920x1080 as `vitrine insert` renders it. SCENE.json is the
// 40_scene/scene.json of a workspace. Wall seconds on all cores, and CPU seconds. --out FOLDER
// keeps the last frame's parts as EXR; --scale, --samples and --noise-target ask for another size
// and quality, for comparisons.
#include "compose/composite.h"
#include "cpu_time.h"
#include "differential_options.h"
#include "image/image_io.h"
#include "scene/insertion.h"

#include <CLI/CLI.hpp>

using namespace vitrine;

namespace {

std::vector<Part> moved(const std::vector<Part>& parts, const Vec3& by) {
    std::vector<Part> result = parts;
    Mat4 shift = Mat4::Identity();
    shift.topRightCorner<3, 1>() = by;
    for (Part& part : result) {
        part.mesh = std::make_shared<const Mesh>(transformed(*part.mesh, shift));
    }
    return result;
}

struct Options {
    std::string scene, insertion, out;
    bool is_final = false;
    double scale = 3;
    DifferentialOptions render;
};

void write_parts(const std::string& folder, const DifferentialImage& image) {
    if (folder.empty()) return;
    std::filesystem::create_directories(folder);
    const auto write = [&](const char* name, const ImageRgb& picture) {
        write_exr(std::filesystem::path(folder) / (std::string(name) + ".exr"), picture);
    };
    write("with", image.with);
    write("without", image.without);
    write("object", image.object);
    write("delta", image.delta());
    write("shadow", image.shadow);
    write("caustics", image.caustics);
    write("reflection", image.reflection);
    write("refraction", image.refraction);
    write("diffuse", image.diffuse);
}

void measure_final(const Options& options, const Scene& real, const Insertion& insertion,
                   const Camera& camera) {
    const Camera large = camera.scaled(options.scale);
    std::unique_ptr<DifferentialRenderer> renderer;
    const Cost photons = cost_of([&] {
        renderer = std::make_unique<DifferentialRenderer>(
            real, insertion.objects, std::span<const Camera>(&large, 1), options.render);
    });
    DifferentialImage image;
    const Cost frame = cost_of([&] { image = renderer->render(large); });
    std::printf("final %dx%d: photons CPU %.1f s, frame CPU %.1f s, wall %.1f s\n", large.width,
                large.height, photons.cpu_s, frame.cpu_s, photons.wall_s + frame.wall_s);
    write_parts(options.out, image);
}

void measure_preview(const Options& options, const Scene& real, const Insertion& insertion,
                     const Camera& camera) {
    RenderScene world;
    const Cost kept = cost_of([&] { world = RenderScene(real); });
    std::printf("world made ready once: CPU %.2f s\n", kept.cpu_s);
    std::vector<double> wall, cpu;
    DifferentialImage image;
    for (int step = 0; step < 7; ++step) {
        const std::vector<Part> parts = moved(insertion.objects, Vec3(0.004 * step, 0, 0));
        std::unique_ptr<DifferentialRenderer> renderer;
        const Cost photons = cost_of([&] {
            renderer = std::make_unique<DifferentialRenderer>(
                world, parts, std::span<const Camera>(&camera, 1), preview_options());
        });
        const Cost frame = cost_of([&] { image = renderer->render(camera); });
        wall.push_back(photons.wall_s + frame.wall_s);
        cpu.push_back(photons.cpu_s + frame.cpu_s);
        std::printf("moved: object and photons CPU %.2f s, frame CPU %.2f s, wall %.2f s\n",
                    photons.cpu_s, frame.cpu_s, wall.back());
        std::fflush(stdout);
    }
    std::printf("preview %dx%d after a move: median CPU %.2f s, wall %.2f s\n", camera.width,
                camera.height, median(cpu), median(wall));
    write_parts(options.out, image);
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app("Seconds of a frame with a virtual object");
    app.add_option("scene", options.scene, "40_scene/scene.json of a workspace")->required();
    app.add_option("insertion", options.insertion, "insertion.json")->required();
    app.add_flag("--final", options.is_final, "One finished frame, not previews");
    app.add_option("--scale", options.scale, "Of the finished frame, to the camera's size");
    app.add_option("--samples", options.render.min_samples, "See DifferentialOptions");
    add_differential_options(app, options.render);
    app.add_option("--seed", options.render.seed, "Of photons and paths");
    app.add_option("--out", options.out, "Write the frame's parts here");
    CLI11_PARSE(app, argc, argv);
    const Scene real = read_scene(options.scene);
    const Insertion insertion = read_insertion(options.insertion);
    const Camera& camera = real.cameras.at(3);
    if (options.is_final) {
        measure_final(options, real, insertion, camera);
    } else {
        measure_preview(options, real, insertion, camera);
    }
    return 0;
}
