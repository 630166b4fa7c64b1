// `vitrine run` and the single stages of half A: the same recipe, stopped earlier.
#include "base/json_reader.h"
#include "command.h"
#include "commands.h"
#include "pipeline/insertion_recipe.h"
#include "pipeline/ior_step.h"

#include <cstdio>

namespace vitrine::cli {
namespace {

struct RunArguments {
    std::string capture, out, poses = "refine", geometry, overrides, ior_step, insertion, at,
                              quality = "final", method = "default";
    int light_photon_count = PaperOptions().lights.photon_count;
    double caustic_photon_count = PaperOptions().caustic_photon_count;
    bool lambertian = false, certificate = false;
    std::uint64_t photon_count = 0;
};

PoseMode pose_mode(const std::string& word) {
    return word == "keep" ? PoseMode::Keep : word == "track" ? PoseMode::Track : PoseMode::Refine;
}

InsertionRunOptions run_options(const RunArguments& arguments, std::uint64_t seed) {
    InsertionRunOptions options;
    options.poses = pose_mode(arguments.poses);
    options.method = method_from_name(arguments.method);
    options.paper.lights.photon_count = arguments.light_photon_count;
    options.paper.caustic_photon_count = arguments.caustic_photon_count;
    options.certificate = arguments.certificate;
    options.lambertian = arguments.lambertian;
    options.geometry = arguments.geometry;
    options.overrides = arguments.overrides;
    options.ior_step = arguments.ior_step;
    if (!options.ior_step.empty()) read_ior_step(options.ior_step);  // wrong: known now, not later
    options.insertion = arguments.insertion;
    if (!arguments.at.empty()) {
        if (arguments.insertion.empty()) throw UsageError("--at needs --insert MESH");
        options.at = parse_placement(arguments.at);
    }
    options.quality =
        arguments.quality == "preview" ? RenderQuality::Preview : RenderQuality::Final;
    options.photon_count = arguments.photon_count;
    options.seed = seed;
    return options;
}

int print_result(const InsertionRunResult& result, const Workspace& workspace, bool as_json) {
    if (as_json) {
        Json pictures = Json::array();
        for (const auto& picture : result.pictures) pictures.push_back(picture.string());
        fmt::print("{}\n", Json({{"workspace", workspace.folder().string()},
                                 {"pictures", pictures},
                                 {"uncertain", result.uncertain},
                                 {"warnings", result.warnings}})
                               .dump(2));
    } else {
        for (const std::string& warning : result.warnings) fmt::print("note: {}\n", warning);
        for (const std::string& sentence : result.uncertain)
            fmt::print("uncertain: {}\n", sentence);
    }
    return result.uncertain.empty() ? kDone : kUncertain;
}

void add_stage(CLI::App& root, const std::string& name, const std::string& summary,
               InsertionStage last) {
    CLI::App* command = root.add_subcommand(name, summary);
    auto arguments = std::make_shared<RunArguments>();
    command
        ->add_option("capture", arguments->capture, "Capture folder (layouts: see `vitrine check`)")
        ->required()
        ->group("Input");
    command
        ->add_option("--out", arguments->out, "Workspace folder; finished stages in it are reused")
        ->required()
        ->group("Output");
    command->add_option("--poses", arguments->poses, "refine, keep or track (ignore given poses)")
        ->capture_default_str()
        ->check(CLI::IsMember({"refine", "keep", "track"}))
        ->group("Quality");
    if (last >= InsertionStage::Candidates) {
        command
            ->add_option("--geometry", arguments->geometry,
                         "Folder of PLY meshes (world, metres) that replace the hulls they overlap")
            ->group("Input");
    }
    if (last >= InsertionStage::Lights) {
        command
            ->add_option("--overrides", arguments->overrides,
                         "JSON of what you know: classes, indices, lights; it is not estimated")
            ->check(CLI::ExistingFile)
            ->group("Input");
        command
            ->add_option("--method", arguments->method,
                         "default, paper (the published joint optimisation), or the baselines it "
                         "compares with: local, inverse-photon")
            ->capture_default_str()
            ->check(CLI::IsMember({"default", "paper", "local", "inverse-photon"}))
            ->group("Quality");
        command
            ->add_option("--light-photons", arguments->light_photon_count,
                         "Photons of each of 36 trial lights (paper, inverse-photon)")
            ->capture_default_str()
            ->check(CLI::Range(1000, 100'000'000))
            ->group("Quality");
    }
    if (last >= InsertionStage::Materials) {
        command
            ->add_option("--caustic-photons", arguments->caustic_photon_count,
                         "Photons per trial index, light and place (paper)")
            ->capture_default_str()
            ->check(CLI::Range(1e3, 1e9))
            ->group("Quality");
        command
            ->add_flag("--lambertian", arguments->lambertian,
                       "Take every object as diffuse (baseline for comparison)")
            ->group("Quality");
        command
            ->add_flag("--certificate", arguments->certificate,
                       "Prove the best roughness of each metal by branch and bound")
            ->group("Quality");
        command
            ->add_option("--ior-step", arguments->ior_step,
                         "Step of the index: a number, or scale.json of `mlds fit`")
            ->group("Quality");
    }
    if (last >= InsertionStage::Insert) {
        auto* insert =
            command->add_option("--insert", arguments->insertion,
                                "Insertion file (vitrine.insertion/1), or a mesh with --at");
        insert->group("Input");
        if (last == InsertionStage::Insert) insert->required();
        command
            ->add_option("--at", arguments->at, "FRAME,U,V: stand the mesh where this pixel looks")
            ->group("Input");
        command->add_option("--quality", arguments->quality, "preview or final")
            ->capture_default_str()
            ->check(CLI::IsMember({"preview", "final"}))
            ->group("Quality");
        command->add_option("--photons", arguments->photon_count, "Caustic photons, 0 = by quality")
            ->capture_default_str()
            ->group("Quality");
    }
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        const InsertionRunOptions options = run_options(*arguments, common->seed);
        if (!options.insertion.empty()) {
            // A missing file should be known now, not after minutes of work.
            if (options.at) {
                if (!std::filesystem::exists(options.insertion)) {
                    throw InputError(
                        {options.insertion.string(), "a mesh file", "no such file", ""});
                }
            } else {
                read_insertion(options.insertion);
            }
        }
        Workspace workspace(arguments->out, {VITRINE_VERSION, command_line(),
                                             resolved_options(*command), common->seed});
        workspace.on_stage([&](const std::string& stage, double seconds, bool was_reused) {
            if (common->quiet || common->json || seconds < 0) return;
            if (was_reused) {
                fmt::print("{:<12} done before\n", stage);
            } else {
                fmt::print("{:<12} {:6.1f} s\n", stage, seconds);
            }
            std::fflush(stdout);
        });
        const InsertionRunResult result =
            run_insertion(arguments->capture, workspace, options, last,
                          [&](const std::string& stage) { return make_progress(*common, stage); });
        return print_result(result, workspace, common->json);
    });
}

}  // namespace

void add_run_command(CLI::App& root) {
    add_stage(root, "run", "Whole chain: capture to measured scene to composites",
              InsertionStage::Report);
    add_stage(root, "reconstruct", "Stage 1: refined poses and the fused surface",
              InsertionStage::Reconstruct);
    add_stage(root, "candidates", "Stage 2: things whose depth lies, with silhouettes and hulls",
              InsertionStage::Candidates);
    add_stage(root, "lights", "Stage 3: lights from the diffuse surfaces", InsertionStage::Lights);
    add_stage(root, "materials", "Stage 4: classes, Ward lobes, refractive indices, absorption",
              InsertionStage::Materials);
    add_stage(root, "insert", "Stage 5: insertion of virtual objects", InsertionStage::Insert);
}

}  // namespace vitrine::cli
