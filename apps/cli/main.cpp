// The table of commands. Each one parses, calls the library and prints; no algorithm lives here.
#include "command.h"
#include "commands.h"

int main(int argc, char** argv) {
    using namespace vitrine::cli;
    return run_main(argc, argv, [](CLI::App& root) {
        for (const auto add : {add_run_command, add_check_command, add_render_command,
                               add_evaluate_command, add_transfer_command, add_mlds_command}) {
            add(root);
        }
    });
}
