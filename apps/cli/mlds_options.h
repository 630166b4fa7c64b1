// apps/cli/mlds_options.h: what the verbs of `vitrine mlds` share.
#pragma once

#include "perception/design.h"
#include "perception/scale_json.h"

#include <CLI/CLI.hpp>

#include <memory>
#include <string>

namespace vitrine::cli {

std::shared_ptr<DesignOptions> add_design_options(CLI::App& command);
/// To a file, or to stdout when `path` is empty.
void write_mlds_text(const std::string& path, const std::string& text);
StimulusSeries read_stimulus_series(const std::string& path);

void add_mlds_stimuli(CLI::App& mlds);
void add_mlds_serve(CLI::App& mlds);
void add_mlds_analysis(CLI::App& mlds);  ///< fit, report, predict

}  // namespace vitrine::cli
