// vitrine_raw_limit [SCENE.json]: how near the renderer comes to Embree's own rate.
//
// The rays of a run are recorded (see ray_recorder.h) and sent again with nothing in between:
// ratio = seconds of the bare rays / seconds of the run, with shading, sampling and storing in the
// run alone. Without a scene: the canonical one, whose three parts cost a ray next to nothing; a
// measured scene (40_scene/scene.json of a workspace) is what the renderer is for. One thread, CPU
// time, run and list in turn, medians.
#include "base/parallel.h"
#include "canonical_scene.h"
#include "cpu_time.h"
#include "ray_recorder.h"
#include "render/render_image.h"

using namespace vitrine;

namespace {

constexpr int kRepeats = 7;

template <typename Run>
void compare(const char* name, const Run& run) {
    start_recording();
    run();
    const RecordedRays recorded = stop_recording();
    std::size_t occlusions = 0;
    for (const RecordedCall& call : recorded.calls)
        occlusions += call.is_occlusion ? call.count : 0;
    ReplaySums sums;
    std::vector<double> ours, bare, apart, ratios;
    for (int i = 0; i < kRepeats; ++i) {
        ours.push_back(cost_of(run).cpu_s);
        bare.push_back(cost_of([&] { sums = replay(recorded); }).cpu_s);
        apart.push_back(cost_of([&] { sums = replay_apart(recorded); }).cpu_s);
        ratios.push_back(bare.back() / ours.back());
    }
    const auto n = static_cast<double>(recorded.rays.size());
    std::printf(
        "%-34s %8zu rays (%2.0f %% occlusion, %2.0f %% hits)  bare %.0f ns/ray (one by one "
        "%.0f)  ours %.0f ns/ray  ratio %.3f\n",
        name, recorded.rays.size(), 100 * static_cast<double>(occlusions) / n,
        100 * static_cast<double>(sums.hits) / n, 1e9 * median(bare) / n, 1e9 * median(apart) / n,
        1e9 * median(ours) / n, median(ratios));
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
    set_thread_count(1);
    const RenderScene scene(argc > 1 ? read_scene(argv[1]) : canonical_scene());
    const Camera camera = scene.scene().cameras.at(2).scaled(0.5);

    CausticOptions caustics;
    caustics.photon_count = 200'000;
    caustics.gather_radius_m = pixel_radius(scene, camera);
    compare("photon tracing", [&] { trace_caustics(scene, caustics); });

    FinalOptions options;
    options.samples_per_pixel = 4;
    compare("path tracing, no photons", [&] { render_image(scene, camera, nullptr, options); });
    options.paths.direct_light_only = true;
    compare("direct light alone", [&] { render_image(scene, camera, nullptr, options); });
    options.paths.direct_light_only = false;
    const CausticMaps maps =
        build_caustic_maps(trace_caustics(scene, caustics).photons, caustics.gather_radius_m);
    compare("path tracing, photon look-up too",
            [&] { render_image(scene, camera, &maps, options); });
    return 0;
}
