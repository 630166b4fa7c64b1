// pipeline/evaluate.h: errors of one workspace against known truth. The only code of the product
// that reads a `truth/` folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

struct EvaluationRow {
    std::string subject;   ///< "light 0", "object_1 (specular_ball)", "insertion 000003"
    std::string quantity;  ///< "direction_error_deg"
    double value = 0.0;
    std::string detail;  ///< the two numbers compared, or words
};

struct Evaluation {
    std::vector<EvaluationRow> rows;
    std::string text() const;  ///< a table
    std::string json() const;
    /// The value of the first row with this subject prefix and quantity; NaN when there is none.
    double value(const std::string& subject_prefix, const std::string& quantity) const;
};

/// Compares `workspace`/estimate.json and its composites with a truth scene file: lights in order
/// of best match by direction, objects by their boxes. Angles are reported both as the full angle
/// between directions and as elevation alone (the differential-rendering paper's metric).
/// @throws InputError when a file is missing or does not fit.
Evaluation evaluate_workspace(const std::filesystem::path& workspace,
                              const std::filesystem::path& truth_scene);

}  // namespace vitrine
