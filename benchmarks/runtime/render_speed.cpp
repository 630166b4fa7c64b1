// vitrine_render_speed WHAT: what the renderer costs on the canonical scene.
//
//   photons [COUNT] [TRIANGLES]  photons stored per CPU second, as one line for povray_peer.py
//   threads                      wall seconds of one thread over those of two, beside what the
//                                machine allows: quiet machine only
//   memory                       resident megabytes for 8 million stored photons, ready to look up
//   growth                       cost against photon count, resolution and triangle count
#include "base/parallel.h"
#include "canonical_scene.h"
#include "cpu_time.h"
#include "render/render_image.h"

#include <cstdlib>
#include <cstring>
#include <sys/wait.h>
#include <unistd.h>

using namespace vitrine;

namespace {

constexpr double kRadius = 0.0008;  // half a pixel of the canonical cameras

CausticOptions photon_options(double count) {
    CausticOptions options;
    options.photon_count = static_cast<std::uint64_t>(count);
    options.gather_radius_m = kRadius;
    return options;
}

void photons(double count, int triangles) {
    set_thread_count(1);
    const RenderScene scene(canonical_scene(triangles));
    CausticPhotons result;
    const Cost cost =
        median_cost(3, [&] { result = trace_caustics(scene, photon_options(count)); });
    std::printf("shot %llu met %llu stored %zu triangles %zu cpu_s %.4f\n",
                static_cast<unsigned long long>(result.balance.shot),
                static_cast<unsigned long long>(result.balance.met), result.photons.size(),
                scene.scene().parts.back().mesh->triangles.size(), cost.cpu_s);
}

/// Wall seconds of two programs of one thread each, which do the work side by side: what two cores
/// that share caches, memory and heat are able to.
template <typename Work>
double side_by_side_s(const Work& work) {
    set_thread_count(1);
    const double start = wall_seconds();
    pid_t children[2];
    for (pid_t& child : children) {
        child = fork();
        if (child != 0) continue;
        work();
        _exit(0);
    }
    for (const pid_t child : children) waitpid(child, nullptr, 0);
    return wall_seconds() - start;
}

void threads() {
    const RenderScene scene(canonical_scene());
    const Camera camera = scene.scene().cameras[2];
    const CausticMaps maps =
        build_caustic_maps(trace_caustics(scene, photon_options(3e5)).photons, kRadius);
    FinalOptions options;
    options.samples_per_pixel = 8;
    const auto compare = [&](const char* name, const auto& work) {
        std::vector<double> ratio, limit, share;
        for (int i = 0; i < 7; ++i) {
            set_thread_count(1);
            const double one = cost_of(work).wall_s;
            limit.push_back(2 * one / side_by_side_s(work));
            set_thread_count(2);
            ratio.push_back(one / cost_of(work).wall_s);
            share.push_back(ratio.back() / limit.back());
        }
        set_thread_count(0);
        std::printf(
            "%-16s two threads against one: %.2f, two programs side by side: %.2f, share of it "
            "%.2f\n",
            name, median(ratio), median(limit), median(share));
        std::fflush(stdout);
    };
    compare("photon tracing", [&] { trace_caustics(scene, photon_options(2e6)); });
    compare("path tracing", [&] { render_image(scene, camera, &maps, options); });
}

void memory() {
    const RenderScene scene(canonical_scene());
    // A photon that meets the ball is stored a little more than once.
    const CausticPhotons few = trace_caustics(scene, photon_options(1e5));
    const double per_shot = static_cast<double>(few.photons.size()) / 1e5;
    const double before = resident_mb();
    CausticPhotons result = trace_caustics(scene, photon_options(8e6 / per_shot));
    const double traced = resident_mb();
    const CausticMaps maps = build_caustic_maps(result.photons, kRadius);
    std::printf(
        "%zu photons: resident %.0f MB when traced, %.0f MB with maps, peak %.0f MB above "
        "the scene's %.0f MB\n",
        result.photons.size(), traced - before, resident_mb() - before, peak_mb() - before, before);
    std::printf("in the maps: %zu sharp, %zu wide\n", maps.sharp.size(), maps.wide.size());
}

void growth() {
    const RenderScene scene(canonical_scene());
    for (const double count : {1e5, 4e5, 1.6e6, 6.4e6}) {
        CausticPhotons result;
        const Cost trace = cost_of([&] { result = trace_caustics(scene, photon_options(count)); });
        CausticMaps maps;
        const Cost build = cost_of([&] { maps = build_caustic_maps(result.photons, kRadius); });
        FinalOptions options;
        options.samples_per_pixel = 4;
        const Camera camera = scene.scene().cameras[2];
        const Cost picture = cost_of([&] { render_image(scene, camera, &maps, options); });
        std::printf(
            "photons %8.0f: tracing %.2f us each, maps %.2f us each, a picture of 640x360x4 "
            "%.2f us per sample (CPU)\n",
            count, 1e6 * trace.cpu_s / count, 1e6 * build.cpu_s / count,
            1e6 * picture.cpu_s / (640.0 * 360 * 4));
        std::fflush(stdout);
    }
    const CausticMaps maps =
        build_caustic_maps(trace_caustics(scene, photon_options(3e5)).photons, kRadius);
    for (const double factor : {0.25, 0.5, 1.0, 2.0}) {
        const Camera camera = scene.scene().cameras[2].scaled(factor);
        FinalOptions options;
        options.samples_per_pixel = 4;
        const Cost picture = cost_of([&] { render_image(scene, camera, &maps, options); });
        std::printf("resolution %4dx%3d: %.2f us per sample (CPU)\n", camera.width, camera.height,
                    1e6 * picture.cpu_s / (4.0 * camera.width * camera.height));
        std::fflush(stdout);
    }
    for (const int triangles : {10'000, 100'000, 1'000'000}) {
        RenderScene fine;
        const Cost build = cost_of([&] { fine = RenderScene(canonical_scene(triangles)); });
        const Cost trace = cost_of([&] { trace_caustics(fine, photon_options(3e5)); });
        FinalOptions options;
        options.samples_per_pixel = 2;
        const Cost picture =
            cost_of([&] { render_image(fine, fine.scene().cameras[2], &maps, options); });
        std::printf(
            "triangles %7d: scene ready after %.2f s, a photon %.2f us, a sample %.2f us "
            "(CPU)\n",
            triangles, build.cpu_s, 1e6 * trace.cpu_s / 3e5,
            1e6 * picture.cpu_s / (640.0 * 360 * 2));
        std::fflush(stdout);
    }
}

}  // namespace

int main(int argc, char** argv) {
    const char* what = argc > 1 ? argv[1] : "";
    if (std::strcmp(what, "photons") == 0) {
        photons(argc > 2 ? std::atof(argv[2]) : 1e6, argc > 3 ? std::atoi(argv[3]) : 20'000);
    } else if (std::strcmp(what, "threads") == 0) {
        threads();
    } else if (std::strcmp(what, "memory") == 0) {
        memory();
    } else if (std::strcmp(what, "growth") == 0) {
        growth();
    } else {
        std::fprintf(stderr,
                     "usage: vitrine_render_speed photons [COUNT] [TRIANGLES] | threads | memory | "
                     "growth\n");
        return 2;
    }
    return 0;
}
