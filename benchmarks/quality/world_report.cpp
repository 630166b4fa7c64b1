// Tables of many worlds' errors; declared in world_errors.h.
#include "math/statistics.h"
#include "world_errors.h"

#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>

namespace vitrine {

namespace {

constexpr double kMinCoverage = 0.88, kMaxCoverage = 0.99;  // of two standard deviations
constexpr double kMaxDeviationRatio = 1.5;                  // median deviation over rms error
constexpr double kMaxGridRatio = 0.25;                      // our light error over the grid's
constexpr std::size_t kMinValues = 8;                       // fewer say nothing of coverage
constexpr double kNominalCoverage = 0.9545;                 // of exact intervals
constexpr double kMinChance = 0.05;                         // rarer is no accident

struct Column {
    std::vector<double> size;       // |error| of all
    std::vector<double> converged;  // |error| where the outcome is converged
    std::vector<double> stddev;     // of those that report one
    std::size_t covered = 0, weak = 0;
    std::size_t worlds = 0;  // with a deviation; the channels of one object err together
};

const char* verdict(bool is_met) { return is_met ? "pass" : "MISS"; }

/// The bar's verdict. Few worlds cannot tell 99 % from 100 %: when all are covered, the ratio and
/// the chance that exact intervals cover as many decide, and the chance is printed.
std::string verdict_on(const Column& column, double coverage, double ratio) {
    if (coverage < kMinCoverage || ratio > kMaxDeviationRatio) return "MISS";
    if (coverage <= kMaxCoverage) return "pass";
    const double chance = std::pow(kNominalCoverage, static_cast<double>(column.worlds));
    char text[60];
    std::snprintf(text, sizeof text, "%s: all of %zu worlds, chance %.0f %%",
                  verdict(chance >= kMinChance), column.worlds, 100.0 * chance);
    return text;
}

void print_quantities(const std::vector<WorldErrors>& all) {
    std::map<std::string, Column> columns;
    for (const WorldErrors& world : all) {
        std::set<std::string> seen;
        for (const QuantityError& q : world.quantities) {
            Column& column = columns[q.name];
            const double size = std::abs(q.error);
            column.size.push_back(size);
            column.weak += q.outcome != "converged";
            if (q.stddev < 0.0 || q.outcome != "converged") continue;
            column.converged.push_back(size);
            column.stddev.push_back(q.stddev);
            column.covered += size <= 2.0 * q.stddev;
            column.worlds += seen.insert(q.name).second;
        }
    }
    std::printf(
        "\n| error of | values | not converged | median | 90th percentile | rms | "
        "median sd | sd / rms (<= 1.5) | within 2 sd (88 to 99 %%) | |\n"
        "|---|---|---|---|---|---|---|---|---|---|\n");
    for (const auto& [name, column] : columns) {
        std::printf("| %s | %zu | %zu | %.3g | %.3g |", name.c_str(), column.size.size(),
                    column.weak, median(column.size), quantile(column.size, 0.9));
        if (column.stddev.size() < kMinValues) {
            std::printf(" | | | | too few |\n");
            continue;
        }
        double square = 0.0;
        for (const double e : column.converged) square += e * e;
        const double rms = std::sqrt(square / static_cast<double>(column.converged.size()));
        const double ratio = median(column.stddev) / rms;
        const double coverage =
            static_cast<double>(column.covered) / static_cast<double>(column.stddev.size());
        std::printf(" %.3g | %.3g | %.2f | %.0f %% | %s |\n", rms, median(column.stddev), ratio,
                    100.0 * coverage, verdict_on(column, coverage, ratio).c_str());
    }
}

void print_classes(const std::vector<WorldErrors>& all) {
    std::map<std::string, std::map<std::string, int>> table;
    int right = 0, unsure = 0;
    for (const WorldErrors& world : all) {
        ++table[world.true_class][world.found_class];
        right += world.true_class == world.found_class;
        unsure += world.found_class == "unsure";
    }
    std::printf("\nclasses: %d of %zu right, %d unsure\n", right, all.size(), unsure);
    for (const auto& [truth, found] : table) {
        std::printf("  %s:", truth.c_str());
        for (const auto& [name, count] : found) std::printf(" %d called %s", count, name.c_str());
        std::printf("\n");
    }
}

void print_lights(const std::vector<WorldErrors>& all) {
    int right_number = 0;
    std::vector<double> ours, grid;
    for (const WorldErrors& world : all) {
        right_number += world.true_lights == world.found_lights;
        for (const QuantityError& q : world.quantities)
            if (q.name == "direction_deg") {
                ours.push_back(q.error);
                grid.push_back(world.grid_error_deg);
            }
    }
    std::printf("\nnumber of lights right in %d of %zu\n", right_number, all.size());
    if (ours.empty()) return;
    const double ratio = mean(ours) / mean(grid);
    std::printf(
        "mean light error %.2f deg, best of the 36 grid lights %.2f deg: ratio %.3f, bar "
        "%.2f, %s\n",
        mean(ours), mean(grid), ratio, kMaxGridRatio, verdict(ratio <= kMaxGridRatio));
}

}  // namespace

void print_world_report(const std::vector<WorldErrors>& all) {
    if (all.empty()) {
        std::printf("no worlds\n");
        return;
    }
    std::vector<double> world_seconds, estimate_seconds;
    for (const WorldErrors& world : all) {
        world_seconds.push_back(world.world_cpu_seconds);
        estimate_seconds.push_back(world.estimate_cpu_seconds);
    }
    std::printf("\n%zu worlds; median CPU seconds: %.1f to make one, %.1f to estimate\n",
                all.size(), median(world_seconds), median(estimate_seconds));
    print_quantities(all);
    print_classes(all);
    print_lights(all);
}

}  // namespace vitrine
