#include "command.h"

#include "base/log.h"
#include "base/parallel.h"
#include "base/text.h"
#include "json_config.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>
#include <unistd.h>

namespace vitrine::cli {
namespace {

std::atomic<int> received_signal{0};
int exit_code = kDone;
std::vector<std::string> words;

/// A stage that is deep in an outside library cannot look at the flag: two seconds after the signal
/// the process ends all the same. Files are replaced by rename, so none is half written.
void watch_for_signals() {
    std::thread([] {
        while (received_signal.load() == 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
        std::this_thread::sleep_for(std::chrono::milliseconds(1600));
        const char text[] = "stopped; the same command goes on where this one was\n";
        [[maybe_unused]] const auto written = ::write(2, text, sizeof text - 1);
        ::_exit(received_signal.load() == SIGTERM ? kTerminated : kInterrupted);
    }).detach();
}

void on_signal(int signal) { received_signal.store(signal); }

void print_error(const std::string& text) { fmt::print(stderr, "vitrine: {}\n", text); }

/// CLI11 says what it did not expect; we add what was perhaps meant.
std::string nearest_option(const CLI::App& root, int argc, char** argv) {
    const CLI::App* leaf = &root;
    while (!leaf->get_subcommands().empty()) leaf = leaf->get_subcommands().front();
    std::vector<std::string> known;
    for (const CLI::Option* option : leaf->get_options({})) {
        for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    }
    for (const CLI::App* sub : leaf->get_subcommands({})) known.push_back(sub->get_name());
    for (int i = 1; i < argc; ++i) {
        const std::string word = std::string(argv[i]).substr(0, std::string(argv[i]).find('='));
        if (word.rfind("--", 0) != 0 && leaf != &root) continue;
        if (std::find(known.begin(), known.end(), word) != known.end()) continue;
        const std::string near = nearest_name(word, known);
        if (!near.empty()) return fmt::format(" Did you mean {}?", near);
    }
    return "";
}

}  // namespace

std::shared_ptr<CommonOptions> add_common_options(CLI::App& command) {
    auto common = std::make_shared<CommonOptions>();
    const std::string group = "Diagnostics";
    command.add_option("--seed", common->seed, "Seed of all random numbers: one seed, one answer")
        ->capture_default_str()
        ->group("Quality");
    command
        .add_option("--threads", common->threads,
                    "Threads, 0 = all cores; results do not depend on it")
        ->capture_default_str()
        ->check(CLI::Range(0, 1024))
        ->group(group);
    command.add_flag("--json", common->json, "Print the result as JSON on stdout")->group(group);
    command.add_flag("-v,--verbose", common->verbose, "Say more on stderr")->group(group);
    command.add_flag("-q,--quiet", common->quiet, "Say nothing but errors")->group(group);
    command.add_option("--progress", common->progress, "auto (a bar on a terminal), json or none")
        ->capture_default_str()
        ->check(CLI::IsMember({"auto", "json", "none"}))
        ->group(group);
    command.add_option("--config", "Read options from a JSON file, such as an earlier run.json")
        ->configurable(false)
        ->group(group);  // expand_config has replaced it before parsing
    command
        .add_flag_function(
            "--print-config", [](std::int64_t) {}, "Print the resolved options as JSON and stop")
        ->configurable(false)
        ->group(group);
    return common;
}

void on_run(CLI::App& command, std::shared_ptr<CommonOptions> common, std::function<int()> work) {
    CLI::App* app = &command;
    command.callback([app, common, work = std::move(work)] {
        if (app->count("--print-config") > 0) {
            fmt::print("{}\n", resolved_options(*app));
            return;
        }
        set_thread_count(common->threads);
        set_log_level(common->quiet     ? LogLevel::Quiet
                      : common->verbose ? LogLevel::Debug
                                        : LogLevel::Warning);
        exit_code = work();
    });
}

const std::vector<std::string>& command_line() { return words; }

std::string resolved_options(const CLI::App& command) { return options_as_json(command); }

Progress make_progress(const CommonOptions& common, const std::string& stage) {
    const bool as_json = common.progress == "json";
    const bool as_bar = common.progress == "auto" && !common.quiet && ::isatty(2) == 1;
    auto last = std::make_shared<int>(-1);
    return Progress([=](double fraction, std::string_view what) {
        const int percent = static_cast<int>(100 * fraction);
        if (percent != *last && (as_json || as_bar)) {
            *last = percent;
            if (as_json) {
                fmt::print(stderr, "{{\"stage\": \"{}\", \"percent\": {}, \"what\": \"{}\"}}\n",
                           stage, percent, what);
            } else {
                const std::string done(static_cast<std::size_t>(percent) * 30 / 100, '=');
                fmt::print(stderr, "\r{:<11} [{:<30}] {:3d} % {:<24.24}", stage, done, percent,
                           what);
                if (percent == 100) fmt::print(stderr, "\r{:<80}\r", "");
                std::fflush(stderr);
            }
        }
        return received_signal.load() == 0;
    });
}

int run_main(int argc, char** argv, const std::function<void(CLI::App&)>& add_commands) {
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    watch_for_signals();
    CLI::App root{
        "Vitrine: measured glass and metal, from RGB-D captures and photographs to insertion"};
    root.require_subcommand(1);
    root.name("vitrine");
    root.set_version_flag("--version", VITRINE_VERSION);
    root.set_help_all_flag("--help-all", "Help of all commands");
    try {
        words.assign(argv + 1, argv + argc);
        add_commands(root);
        std::vector<std::string> arguments = expand_config(words);
        std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
        root.parse(arguments);
        return exit_code;
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return root.exit(error);  // --help, --version
        print_error(error.what() + nearest_option(root, argc, argv));
        return kUsage;
    } catch (const UsageError& error) {
        print_error(error.what());
        return kUsage;
    } catch (const InputError& error) {
        print_error(error.what());
        return kBadInput;
    } catch (const Cancelled&) {
        print_error("stopped; the same command goes on where this one was");
        return received_signal.load() == SIGTERM ? kTerminated : kInterrupted;
    } catch (const std::bad_alloc&) {
        print_error("out of memory: use fewer photons, larger voxels or a smaller picture");
        return kOurFault;
    } catch (const std::exception& error) {
        print_error(error.what());
        return kOurFault;
    }
}

}  // namespace vitrine::cli
