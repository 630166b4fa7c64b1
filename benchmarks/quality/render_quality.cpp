// vitrine_render_quality: renders the true scene of a synthetic capture, with and without its
// virtual object, and compares with the pictures that another renderer made of it.
#include "base/timer.h"
#include "differential_options.h"
#include "insert_quality.h"

#include <CLI/CLI.hpp>

#include <cstdio>

namespace vitrine {
namespace {
namespace fs = std::filesystem;

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
    add_differential_options(app, options.differential);
    app.add_option("--crease-deg", options.crease_deg, "Smooth the real parts below this angle");
    app.add_option("--object-crease-deg", options.object_crease_deg,
                   "Smooth the virtual object below this angle");
    app.add_flag("--second-seed", options.has_second_seed,
                 "Insert twice: what differs is our own noise");
    app.add_option("--path-samples", options.path_samples,
                   "Paths a pixel, without photons, to tell our error from the truth's; 0: none");
    app.add_option("--window", options.window, "Of those: x y width height")->expected(4);
    app.add_option("--truth", options.rerendered,
                   "Folder of the truth rendered again by cycles_truth.py, to measure it as well")
        ->check(CLI::ExistingDirectory);
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
