#include "base/json_reader.h"
#include "capture/check.h"
#include "capture/read_capture.h"
#include "command.h"
#include "commands.h"

namespace vitrine::cli {

void add_check_command(CLI::App& root) {
    CLI::App* command =
        root.add_subcommand("check", "Say whether a capture can be used, and why not");
    auto folder = std::make_shared<std::string>();
    command
        ->add_option("capture", *folder,
                     "Capture folder: TUM RGB-D, Redwood, nerfstudio, COLMAP or Polycam raw")
        ->required()
        ->group("Input");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        const CaptureReader& reader = find_capture_reader(*folder);
        const Capture capture = read_capture(*folder, make_progress(*common, "check"));
        std::vector<Verdict> verdicts = check_capture(capture);
        verdicts.insert(verdicts.begin(),
                        {Severity::Good, fmt::format("layout of {}", reader.name)});
        static const char* const words[] = {"good", "note", "problem"};
        bool has_problem = false;
        Json list = Json::array();
        for (const Verdict& verdict : verdicts) {
            const char* word = words[static_cast<int>(verdict.severity)];
            has_problem |= verdict.severity == Severity::Problem;
            list.push_back({{"severity", word}, {"sentence", verdict.sentence}});
            if (!common->json) fmt::print("{:<8} {}\n", word, verdict.sentence);
        }
        if (common->json) {
            fmt::print(
                "{}\n",
                Json({{"capture", capture.name}, {"usable", true}, {"verdicts", list}}).dump(2));
        } else {
            fmt::print("{}\n", has_problem ? "usable, with the problems above" : "usable");
        }
        return kDone;
    });
}

}  // namespace vitrine::cli
