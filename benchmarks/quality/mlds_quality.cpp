// Times and noise of difference scaling, for docs/results.md.
// Usage: vitrine_mlds_quality [--size PX] [SERIES.json ...]
// Without files: the fit of 210 answers and the bootstrap. With series files: the pictures of each
// are rendered into a scratch folder, at full size unless --size says otherwise; the time includes
// the extra pictures that measure their noise.
#include "base/parallel.h"
#include "math/statistics.h"
#include "perception/design.h"
#include "perception/observer_model.h"
#include "perception/scale_bootstrap.h"
#include "pipeline/mlds_stimuli.h"
#include "process_cost.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>

namespace vitrine {
namespace {
namespace fs = std::filesystem;

struct Times {
    double wall_s = 0, cpu_s = 0;
};

template <typename Work>
Times times_of(const Work& work) {
    const auto begin = std::chrono::steady_clock::now();
    const CpuTimer cpu;
    work();
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
            cpu.seconds()};
}

void time_analysis() {
    const auto ior = equal_steps(1.4, 1.465, 10);
    const auto trials =
        simulate_answers({scale_with_threshold(ior, 0.010)}, all_quadruples(10), 2026);
    DifferenceScale scale;
    std::vector<double> fit_ms;
    for (int i = 0; i < 101; ++i) {
        fit_ms.push_back(1e3 * times_of([&] { scale = fit_scale(trials); }).wall_s);
    }
    fmt::print("fit of {} answers: {:.2f} ms (median of {}; bar 5 ms)\n", trials.size(),
               median(fit_ms), fit_ms.size());
    const auto cells = group_trials(trials, 10);
    const SmoothFitter fitter(cells, ior);
    const SmoothScale smooth = fitter.fit(cells.data.ones);
    ScaleBootstrap bootstrap;
    const Times t =
        times_of([&] { bootstrap = bootstrap_scale(cells, scale, fitter, smooth, ior); });
    fmt::print(
        "{} bootstrap refits of scale and lambda: {:.2f} s wall, {:.2f} s CPU on {} threads (bar "
        "10 s on 2 cores); lambda {:.4f}, 95 % {:.4f} to {:.4f}\n",
        bootstrap.replicates, t.wall_s, t.cpu_s, thread_count(), threshold_of(smooth, ior).value,
        bootstrap.lambda.low, bootstrap.lambda.high);
}

void time_stimuli(const fs::path& file, int size_px) {
    const SeriesSpec spec = read_series_spec(file);
    const fs::path folder = fs::temp_directory_path() / ("vitrine_mlds_" + file.stem().string());
    StimuliOptions options;
    options.size_px = size_px;
    StimulusSeries series;
    const Times t = times_of([&] { series = render_stimuli(spec, folder, options); });
    fmt::print(
        "{}: {} pictures in {:.0f} s wall, {:.0f} s CPU on {} threads (bar 120 s on 2 cores)\n"
        "  noise of L*, 99th percentile: a picture {:.3f}, as seen {:.3f}; difference of two "
        "neighbours {:.3f}, as seen {:.3f}; pictures in {}\n",
        file.stem().string(), series.images.size(), t.wall_s, t.cpu_s, thread_count(),
        series.noise.picture, series.noise.picture_seen, series.noise.difference,
        series.noise.difference_seen, folder.string());
}

}  // namespace
}  // namespace vitrine

int main(int argc, char** argv) {
    try {
        if (argc == 1) vitrine::time_analysis();
        int size_px = 0;
        for (int i = 1; i < argc; ++i) {
            if (std::string(argv[i]) == "--size" && i + 1 < argc) {
                size_px = std::stoi(argv[++i]);
            } else {
                vitrine::time_stimuli(argv[i], size_px);
            }
        }
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 1;
    }
    return 0;
}
