// vitrine_insertion_speed SCENE.json INSERTION.json [--final | OUT.exr]: the two modes of
// inserting.
//
// Preview: seconds from moving the virtual object to a new 640x360 frame, with the unmoved world
// kept. --final: a frame of 1920x1080 as `vitrine insert` renders it. SCENE.json is the
// 40_scene/scene.json of a workspace. Wall seconds on all cores, and CPU seconds.
#include "compose/composite.h"
#include "cpu_time.h"
#include "image/image_io.h"
#include "render/differential.h"
#include "scene/insertion.h"

#include <cstdlib>
#include <cstring>

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

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) {
        std::fprintf(
            stderr,
            "usage: vitrine_insertion_speed SCENE.json INSERTION.json [--final | OUT.exr]\n");
        return 2;
    }
    const Scene real = read_scene(argv[1]);
    const Insertion insertion = read_insertion(argv[2]);
    const Camera& camera = real.cameras.at(3);
    std::unique_ptr<DifferentialRenderer> renderer;
    if (argc > 3 && std::strcmp(argv[3], "--final") == 0) {
        const Camera large = camera.scaled(3);
        const Cost photons = cost_of([&] {
            renderer = std::make_unique<DifferentialRenderer>(real, insertion.objects,
                                                              std::span<const Camera>(&large, 1));
        });
        DifferentialImage image;
        const Cost frame = cost_of([&] { image = renderer->render(large); });
        std::printf("final %dx%d: photons CPU %.1f s, frame CPU %.1f s, wall %.1f s\n", large.width,
                    large.height, photons.cpu_s, frame.cpu_s, photons.wall_s + frame.wall_s);
        return 0;
    }
    RenderScene world;
    const Cost kept = cost_of([&] { world = RenderScene(real); });
    std::printf("world made ready once: CPU %.2f s\n", kept.cpu_s);
    std::vector<double> wall, cpu;
    for (int step = 0; step < 7; ++step) {
        const std::vector<Part> parts = moved(insertion.objects, Vec3(0.004 * step, 0, 0));
        DifferentialImage image;
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
        if (argc > 3 && step == 6) write_exr(argv[3], image.with);
    }
    std::printf("preview %dx%d after a move: median CPU %.2f s, wall %.2f s\n", camera.width,
                camera.height, median(cpu), median(wall));
    return 0;
}
