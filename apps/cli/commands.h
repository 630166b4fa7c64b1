// apps/cli/commands.h: the commands of `vitrine`, one function and one file each.
#pragma once

#include <CLI/CLI.hpp>

namespace vitrine::cli {

void add_run_command(CLI::App& root);  ///< and the single stages of half A
void add_check_command(CLI::App& root);
void add_render_command(CLI::App& root);
void add_evaluate_command(CLI::App& root);
void add_transfer_command(CLI::App& root);
void add_mlds_command(CLI::App& root);

}  // namespace vitrine::cli
