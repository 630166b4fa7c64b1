// Errors of the estimators, and of the doubts they report, over many made worlds:
//   vitrine_estimation_worlds [--seeds FIRST:LAST] [--results FILE.jsonl]
//                             [--only-metal | --only-glass] [--joint
//                             separate|likelihoods|highlights] [--verbose]
//   vitrine_estimation_worlds --report FILE.jsonl [FILE...] [--only odd|even]
// Each world is one line of FILE; seeds already there are skipped, so a run can be stopped and
// resumed, and several may run side by side on files of their own. Seeds with which constants of
// the estimators were set (docs/estimation.md) check nothing: report others.
#include "base/log.h"
#include "estimate/scene_estimate.h"
#include "synthetic/world.h"
#include "world_errors.h"
#include "world_series.h"

#include <cstdio>
#include <ctime>
#include <optional>
#include <set>

using namespace vitrine;

namespace {

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

void run_worlds(std::uint64_t first, std::uint64_t last, std::optional<WorldObject> only_object,
                bool is_verbose, const EstimateOptions& estimation,
                const std::filesystem::path& file) {
    std::set<std::uint64_t> done;
    for (const WorldErrors& known : read_world_errors(file)) done.insert(known.seed);
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        if (done.contains(seed)) continue;
        const WorldOptions options = series_world(seed);
        if (only_object && options.object != *only_object) continue;
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
    std::optional<WorldObject> only_object;
    bool is_verbose = false;
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
            only_object = WorldObject::Metal;
        } else if (argument == "--only-glass") {
            only_object = WorldObject::Glass;
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
        run_worlds(first, last, only_object, is_verbose, estimation, results);
        reports = {results};
    }
    std::vector<WorldErrors> all;
    for (const std::filesystem::path& file : reports)
        for (WorldErrors& errors : read_world_errors(file))
            if (only.empty() || (errors.seed % 2 == 1) == (only == "odd"))
                all.push_back(std::move(errors));
    print_world_report(all);
}
