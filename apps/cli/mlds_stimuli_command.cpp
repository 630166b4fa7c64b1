#include "base/error.h"
#include "command.h"
#include "mlds_options.h"
#include "pipeline/mlds_presets.h"
#include "pipeline/mlds_stimuli.h"

namespace vitrine::cli {
namespace fs = std::filesystem;

void add_mlds_stimuli(CLI::App& mlds) {
    CLI::App* command = mlds.add_subcommand("stimuli", "Render the series of pictures");
    struct Options : StimuliOptions {
        std::string series, scene, part, out, integrator = "photon";
        std::vector<double> ior;
        double from = 1.4, to = 1.465;
        int count = 10;
        bool presets = false;
    };
    auto o = std::make_shared<Options>();
    command->add_option("series", o->series, "Series file, e.g. scenes/mlds/sphere_point.json")
        ->group("Input");
    command->add_option("--scene", o->scene, "Scene file, in place of a series")->group("Input");
    command->add_option("--part", o->part, "Dielectric part whose index varies (--scene)")
        ->group("Input");
    command->add_option("--ior", o->ior, "List of indices; replaces those of the series")
        ->delimiter(',')
        ->group("Input");
    command->add_option("--from", o->from, "First index (--scene)")
        ->capture_default_str()
        ->group("Input");
    command->add_option("--to", o->to, "Last index (--scene)")
        ->capture_default_str()
        ->group("Input");
    command->add_option("--count", o->count, "Number of equal steps (--scene)")
        ->capture_default_str()
        ->check(CLI::Range(4, 40))
        ->group("Input");
    command->add_option("--out", o->out, "Folder for pictures and stimuli.json")
        ->required()
        ->group("Output");
    command->add_flag("--write-presets", o->presets, "Write the preset scenes to --out and stop")
        ->group("Output");
    command->add_option("--integrator", o->integrator, "photon or path")
        ->capture_default_str()
        ->check(CLI::IsMember({"photon", "path"}))
        ->group("Quality");
    command->add_option("--samples", o->samples_per_pixel, "Paths of every pixel")
        ->capture_default_str()
        ->check(CLI::Range(2, 65536))
        ->group("Quality");
    command->add_option("--max-samples", o->max_samples_per_pixel, "Paths of a noisy pixel at most")
        ->capture_default_str()
        ->check(CLI::Range(2, 65536))
        ->group("Quality");
    command->add_option("--deviation-l", o->deviation_l, "Deviation of L* at which a pixel is done")
        ->capture_default_str()
        ->check(CLI::PositiveNumber)
        ->group("Quality");
    command
        ->add_option("--smooth-px", o->smooth_px,
                     "Blur of light from all around on flat plain surfaces; 0 = none")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 20.0))
        ->group("Quality");
    command->add_option("--photons", o->photon_count, "Photons per picture")
        ->capture_default_str()
        ->group("Quality");
    command->add_option("--gather-radius-m", o->gather_radius_m, "Blur of the caustic; 0 = a pixel")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber)
        ->group("Quality");
    command->add_option("--bounces", o->diffuse_bounces, "Of lamp light between diffuse surfaces")
        ->capture_default_str()
        ->check(CLI::Range(0, 16))
        ->group("Quality");
    command->add_option("--size-px", o->size_px, "Side of the pictures; 0 = the camera's")
        ->capture_default_str()
        ->check(CLI::Range(0, 4096))
        ->group("Quality");
    command->add_option("--exposure", o->exposure, "Radiance to display; 0 = chosen, one for all")
        ->capture_default_str()
        ->group("Quality");
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        if (o->presets) {
            write_mlds_presets(o->out);
            return kDone;
        }
        if (o->series.empty() == o->scene.empty()) {
            throw UsageError("give either a series file or --scene with --part");
        }
        SeriesSpec spec;
        if (!o->series.empty()) {
            spec = read_series_spec(o->series);
        } else {
            spec = {fs::path(o->scene).stem().string(), read_scene(o->scene), o->part,
                    equal_steps(o->from, o->to, o->count)};
        }
        if (!o->ior.empty()) spec.ior = o->ior;
        o->use_photons = o->integrator == "photon";
        o->seed = common->seed;
        const StimulusSeries series =
            render_stimuli(spec, o->out, *o, make_progress(*common, "stimuli"));
        if (common->json) {
            fmt::print("{}", series_to_json(series));
        } else {
            fmt::print(
                "{} pictures in {}, exposure {:.4g}; noise of L* (99th percentile): a picture "
                "{:.2f}, as seen {:.2f}; difference of neighbours {:.2f}, as seen {:.2f}\n",
                series.images.size(), o->out, series.exposure, series.noise.picture,
                series.noise.picture_seen, series.noise.difference, series.noise.difference_seen);
        }
        return kDone;
    });
}

}  // namespace vitrine::cli
