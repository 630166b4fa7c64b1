// apps/cli/command.h: what every command shares: common options, progress, exit codes.
//
// A command file has one function `void add_<name>_command(CLI::App& root)`: it declares its
// options and sets a callback that parses, calls the library and prints. To add a command, write
// that file and name the function in the table of main.cpp.
#pragma once

#include "base/error.h"
#include "base/progress.h"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace vitrine::cli {

enum ExitCode {
    kDone = 0,
    kOurFault = 1,
    kUsage = 2,
    kBadInput = 3,
    kUncertain = 4,  ///< result written, but a quantity did not converge or is not identifiable
    kInterrupted = 130,
    kTerminated = 143,
};

struct CommonOptions {
    std::uint64_t seed = 0;
    int threads = 0;
    bool json = false;
    bool verbose = false;
    bool quiet = false;
    std::string progress = "auto";
};

/// Adds --seed --threads --json --verbose --quiet --progress --config --print-config to `command`.
/// The callback set with `on_run` runs after they took effect and returns the exit code.
std::shared_ptr<CommonOptions> add_common_options(CLI::App& command);

/// Sets what the command does. Exit codes are collected by main.
void on_run(CLI::App& command, std::shared_ptr<CommonOptions> common, std::function<int()> work);

/// A bar on stderr when it is a terminal, JSON lines with `--progress json`, else silence. Learns
/// of SIGINT and SIGTERM.
Progress make_progress(const CommonOptions& common, const std::string& stage);

/// Options of `command` as given or by default, as JSON text, for run.json.
std::string resolved_options(const CLI::App& command);

/// The words of this run, without the program's name.
const std::vector<std::string>& command_line();

/// Runs main's table; catches every exception once and turns it into an exit code.
int run_main(int argc, char** argv, const std::function<void(CLI::App&)>& add_commands);

}  // namespace vitrine::cli
