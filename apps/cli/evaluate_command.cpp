#include "base/file.h"
#include "command.h"
#include "commands.h"
#include "pipeline/evaluate.h"

namespace vitrine::cli {

void add_evaluate_command(CLI::App& root) {
    CLI::App* command =
        root.add_subcommand("evaluate", "Errors of a workspace against known truth");
    auto folder = std::make_shared<std::string>();
    auto truth = std::make_shared<std::string>();
    command->add_option("workspace", *folder, "Folder written by `vitrine run`")
        ->required()
        ->check(CLI::ExistingDirectory)
        ->group("Input");
    command->add_option("--truth", *truth, "scene.json of the truth, with its pictures beside it")
        ->required()
        ->check(CLI::ExistingFile)
        ->group("Input");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        const Evaluation evaluation = evaluate_workspace(*folder, *truth);
        write_text_file(std::filesystem::path(*folder) / "evaluation.json",
                        evaluation.json() + "\n");
        fmt::print("{}\n", common->json ? evaluation.json() : evaluation.text());
        return kDone;
    });
}

}  // namespace vitrine::cli
