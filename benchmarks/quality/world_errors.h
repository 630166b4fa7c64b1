// benchmarks/quality/world_errors.h: what an estimate of a made world gets wrong, and tables of it.
#pragma once

#include "estimate/scene_estimate.h"
#include "synthetic/world.h"

#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

/// One figure of one world, in the unit that its name ends on.
struct QuantityError {
    std::string name;
    double error = 0.0;    ///< estimated minus true
    double stddev = -1.0;  ///< as reported; negative: none
    std::string outcome = "converged";
};

struct WorldErrors {
    std::uint64_t seed = 0;
    std::string kind;  ///< "glass torus, 2 lamps"
    double world_cpu_seconds = 0.0, estimate_cpu_seconds = 0.0;
    std::string true_class, found_class;
    int true_lights = 1, found_lights = 1;
    double grid_error_deg = 0.0;  ///< of the best of the 36 grid lights
    /// Mean over the true lights of the nearest one found: whole angle, and elevation alone (the
    /// paper's metric).
    double light_direction_deg = 0.0, light_elevation_deg = 0.0;
    std::vector<QuantityError> quantities;
};

WorldErrors compare(const WorldOptions& options, const World& world, const SceneEstimate& estimate);

/// One JSON object a line. A missing file is empty.
std::vector<WorldErrors> read_world_errors(const std::filesystem::path& file);
void append_world_errors(const std::filesystem::path& file, const WorldErrors& errors);

std::string one_line(const WorldErrors& errors);
/// Median and 90th percentile of every error, coverage of the deviations, classes, light against
/// grid; each bar as value / bar / pass.
void print_world_report(const std::vector<WorldErrors>& all);

}  // namespace vitrine
