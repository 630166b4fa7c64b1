// Errors of the estimators, and of the doubts they report, over many made worlds:
//   vitrine_estimation_worlds [--seeds FIRST:LAST] [--results FILE.jsonl] [--only-metal]
//                             [--joint separate|likelihoods|highlights] [--verbose]
//   vitrine_estimation_worlds --report FILE.jsonl [FILE...] [--only odd|even]
// Each world is one line of FILE; seeds already there are skipped, so a run can be stopped and
// resumed, and several may run side by side on files of their own. Seeds with which constants of
// the estimators were set (docs/estimation.md) check nothing: report others.
#include "base/log.h"
#include "base/rng.h"
#include "estimate/scene_estimate.h"
#include "synthetic/world.h"
#include "world_errors.h"

#include <cstdio>
#include <ctime>
#include <set>

using namespace vitrine;

namespace {

/// Random kinds, shapes, lights and materials; errors of geometry and poses as reconstruction
/// leaves them (docs/results.md), noise of a good phone.
WorldOptions world_of(std::uint64_t seed) {
    WorldOptions options;
    options.seed = seed;
    Rng rng(stream_key(seed, 0xbe9cULL));
    constexpr WorldObject kKinds[] = {WorldObject::Glass, WorldObject::Metal,  WorldObject::Glass,
                                      WorldObject::Metal, WorldObject::Vessel, WorldObject::Glass,
                                      WorldObject::Metal, WorldObject::Plastic};
    options.object = kKinds[(seed / 2) % 8];
    constexpr WorldShape kShapes[] = {WorldShape::Ball, WorldShape::Bottle, WorldShape::Torus,
                                      WorldShape::Pebble};
    options.shape =
        options.object == WorldObject::Plastic ? WorldShape::Pebble : kShapes[rng.next_index(4)];
    options.light_count = (seed / 2) % 5 == 2 ? 2 : 1;
    options.is_sunny = (seed / 2) % 5 == 4;
    options.width = 160;
    options.height = 120;
    options.samples_per_pixel = 10;
    options.photon_count = 100'000;
    options.sensor_noise = 0.006;
    options.scan_error_m = 0.0008;
    const bool is_revolution =
        options.shape == WorldShape::Ball || options.shape == WorldShape::Bottle;
    options.hull_error_m =
        is_revolution || options.object == WorldObject::Vessel ? 0.00015 : 0.0003;
    options.pose_error_m = 0.0002;
    return options;
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Tells a search that missed from pictures that do not say.
void print_cost_at_truth(const World& world, const SceneEstimate& estimate) {
    LightOptions options = first_light_options(world.capture, {});
    for (const ObjectEstimate& object : estimate.objects)
        options.object_classes.push_back(object.object_class);
    options.start = world.lights;
    const LightEstimate at_truth = estimate_lights(world.labelled, world.capture.frames,
                                                   world.capture.saturation_level, options);
    std::printf("cost of the light found %.4f, refined from the true one %.4f\n",
                estimate.light.error_refined, at_truth.error_refined);
}

void run_worlds(std::uint64_t first, std::uint64_t last, bool is_only_metal, bool is_verbose,
                const EstimateOptions& estimation, const std::filesystem::path& file) {
    std::set<std::uint64_t> done;
    for (const WorldErrors& known : read_world_errors(file)) done.insert(known.seed);
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        if (done.contains(seed)) continue;
        const WorldOptions options = world_of(seed);
        if (is_only_metal && options.object != WorldObject::Metal) continue;
        const double start = cpu_seconds();
        const World world = make_world(options);
        const double made = cpu_seconds();
        const SceneEstimate estimate = estimate_scene(world.labelled, world.capture, estimation);
        if (is_verbose) print_cost_at_truth(world, estimate);
        WorldErrors errors = compare(options, world, estimate);
        errors.world_cpu_seconds = made - start;
        errors.estimate_cpu_seconds = cpu_seconds() - made;
        append_world_errors(file, errors);
        std::printf("%s\n", one_line(errors).c_str());
        std::fflush(stdout);
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::uint64_t first = 0, last = 47;
    std::filesystem::path results = "estimation_worlds.jsonl";
    std::vector<std::filesystem::path> reports;
    std::string only;
    bool is_only_metal = false, is_verbose = false;
    EstimateOptions estimation;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument == "--seeds" && i + 1 < argc) {
            const std::string range = argv[++i];
            const std::size_t colon = range.find(':');
            first = last = std::stoull(range);
            if (colon != std::string::npos) last = std::stoull(range.substr(colon + 1));
        } else if (argument == "--results" && i + 1 < argc) {
            results = argv[++i];
        } else if (argument == "--only" && i + 1 < argc) {
            only = argv[++i];
        } else if (argument == "--only-metal") {
            is_only_metal = true;
        } else if (argument == "--joint" && i + 1 < argc) {
            const std::string mode = argv[++i];
            estimation.joint.mode = mode == "likelihoods"  ? JointMode::Likelihoods
                                    : mode == "highlights" ? JointMode::HighlightsFirst
                                                           : JointMode::Separate;
        } else if (argument == "--verbose") {
            is_verbose = true;
            set_log_level(LogLevel::Debug);
        } else if (argument == "--report") {
            while (i + 1 < argc && argv[i + 1][0] != '-') reports.emplace_back(argv[++i]);
        } else {
            std::fprintf(stderr, "usage: see the first lines of estimation_worlds.cpp\n");
            return 2;
        }
    }
    if (reports.empty()) {
        run_worlds(first, last, is_only_metal, is_verbose, estimation, results);
        reports = {results};
    }
    std::vector<WorldErrors> all;
    for (const std::filesystem::path& file : reports)
        for (WorldErrors& errors : read_world_errors(file))
            if (only.empty() || (errors.seed % 2 == 1) == (only == "odd"))
                all.push_back(std::move(errors));
    print_world_report(all);
}
