// pipeline/insertion_recipe.h: half A from end to end: capture -> measured scene -> composites.
#pragma once

#include "base/progress.h"
#include "estimate/scene_estimate.h"
#include "pipeline/placement.h"
#include "pipeline/workspace.h"
#include "reconstruct/scan.h"

#include <optional>

namespace vitrine {

/// Stages in order; a command names the last one it wants.
enum class InsertionStage { Reconstruct, Candidates, Lights, Materials, Insert, Report };

enum class RenderQuality {
    Preview,  ///< render/differential.h, preview_options(): one bounce, grain in soft shadows
    Final,
};

struct InsertionRunOptions {
    PoseMode poses = PoseMode::Refine;
    EstimateMethod method = EstimateMethod::Default;
    PaperOptions paper;               ///< of the published methods: photon counts
    bool certificate = false;         ///< prove each Ward fit by branch and bound
    bool lambertian = false;          ///< every object diffuse: the baseline of the papers
    std::filesystem::path geometry;   ///< folder of PLY meshes that replace the hulls they overlap
    std::filesystem::path overrides;  ///< JSON of what the user knows
    std::string ior_step;             ///< number or scale.json (ior_step.h); empty: no grid
    std::filesystem::path insertion;  ///< insertion file, or a mesh together with `at`
    std::optional<Placement> at;
    RenderQuality quality = RenderQuality::Final;
    std::uint64_t photon_count = 0;  ///< 0: by quality
    std::uint64_t seed = 0;
};

struct InsertionRunResult {
    /// Sentences about quantities that did not converge or are not identifiable: exit code 4.
    std::vector<std::string> uncertain;
    std::vector<std::string> warnings;  ///< of the capture
    std::vector<std::filesystem::path> pictures;
};

/// Makes a `Progress` for a stage by its name.
using StageProgress = std::function<Progress(const std::string& stage)>;

/// Runs all stages up to `last` that are not done in the workspace.
///
/// Each stage reads what the earlier ones wrote, never what they held in memory: a run that was
/// stopped and went on ends in the same files as one that was not.
/// @throws InputError, MachineError, Cancelled
InsertionRunResult run_insertion(const std::filesystem::path& capture_folder, Workspace& workspace,
                                 const InsertionRunOptions& options, InsertionStage last,
                                 const StageProgress& progress);

}  // namespace vitrine
