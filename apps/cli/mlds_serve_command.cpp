#include "base/error.h"
#include "base/file.h"
#include "command.h"
#include "mlds_options.h"
#include "perception/scale_json.h"
#include "study_server.h"

namespace vitrine::cli {
namespace fs = std::filesystem;

void add_mlds_serve(CLI::App& mlds) {
    CLI::App* command =
        mlds.add_subcommand("serve", "Run the experiment in a browser on this computer");
    struct Options {
        std::string stimuli, out;
        int port = 0, break_every = 70;
        double distance_cm = 55, picture_deg = 8;
    };
    auto o = std::make_shared<Options>();
    command->add_option("stimuli", o->stimuli, "stimuli.json written by `mlds stimuli`")
        ->required()
        ->check(CLI::ExistingFile)
        ->group("Input");
    command->add_option("--out", o->out, "Folder of the study; sessions in it are taken up")
        ->required()
        ->group("Output");
    const auto design = add_design_options(*command);
    command->add_option("--break-every", o->break_every, "Trials between rests")
        ->capture_default_str()
        ->check(CLI::Range(1, 10000))
        ->group("Design");
    command->add_option("--distance-cm", o->distance_cm, "Viewing distance offered")
        ->capture_default_str()
        ->check(CLI::Range(20.0, 300.0))
        ->group("Display");
    command->add_option("--picture-deg", o->picture_deg, "Visual angle of a picture's side")
        ->capture_default_str()
        ->check(CLI::Range(0.5, 40.0))
        ->group("Display");
    command->add_option("--port", o->port, "Port on 127.0.0.1; 0 = any free one")
        ->capture_default_str()
        ->check(CLI::Range(0, 65535))
        ->group("Display");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        const StimulusSeries series = series_from_json(read_text_file(o->stimuli), o->stimuli);
        if (series.images.empty()) {
            throw InputError({o->stimuli, "pictures", "none", "render them with `mlds stimuli`"});
        }
        web::StudyPage page;
        page.title = series.title.empty() ? "Picture study" : series.title;
        page.pictures = web::read_pictures(fs::path(o->stimuli).parent_path(), series.images);
        page.distance_mm = 10 * o->distance_cm;
        page.picture_deg = o->picture_deg;
        page.break_every = o->break_every;
        design->stimulus_count = static_cast<int>(series.ior.size());
        design->seed = common->seed;
        web::StudyServer server(std::move(page), o->out, *design, o->port);
        fmt::print("{}\n", server.url());
        std::fflush(stdout);
        const Progress progress = make_progress(*common, "serve");
        bool was_stopped = false;
        server.serve([&] {
            try {
                progress.update(0.0, "serving");
            } catch (const Cancelled&) {
                was_stopped = true;
            }
            return was_stopped;
        });
        if (was_stopped) throw Cancelled();
        return kDone;
    });
}

}  // namespace vitrine::cli
