// apps/cli/json_config.h: options as JSON: `--config run.json` in, `--print-config` and run.json
// out.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace vitrine::cli {

/// Replaces `--config FILE` by the options in that file, {"option-name": value} or the "options"
/// object of an earlier run.json. What the command line gives itself wins.
/// @throws InputError when the file is malformed; unknown names are refused like any option.
std::vector<std::string> expand_config(const std::vector<std::string>& arguments);

/// Options of `command` as given or by default.
std::string options_as_json(const CLI::App& command);

}  // namespace vitrine::cli
