// vitrine mlds design | stimuli | serve | simulate | fit | report | predict
#include "base/file.h"
#include "base/rng.h"
#include "command.h"
#include "commands.h"
#include "mlds_options.h"
#include "perception/observer_model.h"

namespace vitrine::cli {

std::shared_ptr<DesignOptions> add_design_options(CLI::App& command) {
    auto options = std::make_shared<DesignOptions>();
    command
        .add_option("--trials", options->trial_count,
                    "Main trials per repeat, a balanced subset; 0 = all quadruples")
        ->capture_default_str()
        ->group("Design");
    command.add_option("--repeats", options->repeats, "How often the whole set is asked")
        ->capture_default_str()
        ->group("Design");
    command.add_option("--practice", options->practice_count, "Practice trials, never analysed")
        ->capture_default_str()
        ->group("Design");
    command.add_option("--catch", options->catch_count, "Catch trials, never analysed")
        ->capture_default_str()
        ->group("Design");
    return options;
}

void write_mlds_text(const std::string& path, const std::string& text) {
    if (path.empty()) {
        fmt::print("{}", text);
    } else {
        write_text_file(path, text);
    }
}

StimulusSeries read_stimulus_series(const std::string& path) {
    return series_from_json(read_text_file(path), path);
}

namespace {

void add_design(CLI::App& mlds) {
    CLI::App* command = mlds.add_subcommand("design", "List the trials of a session");
    const auto options = add_design_options(*command);
    command->add_option("--stimuli-count", options->stimulus_count, "Number of stimuli, 4 to 40")
        ->capture_default_str()
        ->group("Design");
    auto out = std::make_shared<std::string>();
    command->add_option("--out", *out, "CSV file; stdout when left out")->group("Output");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        options->seed = common->seed;
        write_mlds_text(*out, design_to_csv(make_design(*options)));
        return kDone;
    });
}

void add_simulate(CLI::App& mlds) {
    CLI::App* command = mlds.add_subcommand("simulate", "Answers of observers we make up");
    struct Options {
        std::string stimuli, out;
        double lambda = 0.010, span = 0.065, power = 1.0, lapse = 0.0;
        int count = 10, observers = 1, repeats = 1;
        std::vector<double> scale;
    };
    auto o = std::make_shared<Options>();
    command->add_option("--stimuli", o->stimuli, "stimuli.json; else equal steps")->group("Input");
    command->add_option("--stimuli-count", o->count, "Number of stimuli")
        ->capture_default_str()
        ->check(CLI::Range(4, 40))
        ->group("Observer");
    command->add_option("--span", o->span, "Range of the index (equal steps)")
        ->capture_default_str()
        ->check(CLI::PositiveNumber)
        ->group("Observer");
    command->add_option("--lambda", o->lambda, "Smallest change with d' = 1")
        ->capture_default_str()
        ->check(CLI::PositiveNumber)
        ->group("Observer");
    command->add_option("--power", o->power, "Curvature: scale proportional to (n - n1)^power")
        ->capture_default_str()
        ->check(CLI::PositiveNumber)
        ->group("Observer");
    command->add_option("--scale", o->scale, "Scale values in units of the noise, instead")
        ->delimiter(',')
        ->group("Observer");
    command->add_option("--lapse", o->lapse, "Share of answers given at random")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0))
        ->group("Observer");
    command->add_option("--observers", o->observers, "Number of observers")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000))
        ->group("Observer");
    command->add_option("--repeats", o->repeats, "How often each question is asked")
        ->capture_default_str()
        ->check(CLI::Range(1, 100))
        ->group("Observer");
    command->add_option("--out", o->out, "CSV file; stdout when left out")->group("Output");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        std::vector<double> ior = o->stimuli.empty() ? equal_steps(1.4, 1.4 + o->span, o->count)
                                                     : read_stimulus_series(o->stimuli).ior;
        const std::vector<double> beta =
            o->scale.empty() ? scale_with_threshold(ior, o->lambda, o->power) : o->scale;
        std::string text = "participant,resp,S1,S2,S3,S4\n";
        for (int i = 0; i < o->observers; ++i) {
            const std::uint64_t seed = stream_key(common->seed, i);
            const auto design = make_design({.stimulus_count = static_cast<int>(beta.size()),
                                             .trial_count = 0,
                                             .repeats = o->repeats,
                                             .practice_count = 0,
                                             .catch_count = 0,
                                             .seed = seed});
            std::vector<Quadruple> questions;
            for (const PlannedTrial& t : design) questions.push_back(t.rank);
            for (const Trial& t : simulate_answers({beta, o->lapse}, questions, seed)) {
                text += fmt::format("simulated_{},{},{},{},{},{}\n", i + 1, t.response, t.rank[0],
                                    t.rank[1], t.rank[2], t.rank[3]);
            }
        }
        write_mlds_text(o->out, text);
        return kDone;
    });
}

}  // namespace

void add_mlds_command(CLI::App& root) {
    CLI::App* mlds = root.add_subcommand(
        "mlds", "The smallest change of refractive index that people see (difference scaling)");
    mlds->require_subcommand(1);
    add_design(*mlds);
    add_mlds_stimuli(*mlds);
    add_mlds_serve(*mlds);
    add_simulate(*mlds);
    add_mlds_analysis(*mlds);
}

}  // namespace vitrine::cli
