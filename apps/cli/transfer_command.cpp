#include "base/json_reader.h"
#include "base/text.h"
#include "command.h"
#include "commands.h"
#include "pipeline/transfer_recipe.h"

namespace vitrine::cli {
namespace {

/// Texts of options that need a second look.
struct TransferTexts {
    std::string source_box, target_box, method = "default", lights = "diffusion";
    std::string solver = "monotone", coupling = "ordered", irradiance = "photo";
    std::string highlights = "residual", colour_space = "srgb";
    std::string shape = "auto", transmittance = "auto", body = "curved";
    bool is_colour_free = false;
};

std::optional<PixelBox> parse_box(const std::string& text, const std::string& option) {
    if (text.empty()) return std::nullopt;
    std::string spaced = text;
    std::replace(spaced.begin(), spaced.end(), ',', ' ');
    const std::vector<std::string> words = split_whitespace(spaced);
    double v[4] = {};
    if (words.size() != 4) throw UsageError(option + ": four numbers x,y,w,h are needed");
    for (std::size_t i = 0; i < 4; ++i)
        if (!parse_double(words[i], v[i])) throw UsageError(option + ": not a number: " + words[i]);
    const int x = static_cast<int>(v[0]), y = static_cast<int>(v[1]);
    return PixelBox{x, y, x + static_cast<int>(v[2]), y + static_cast<int>(v[3])};
}

void add_inputs(CLI::App& command, TransferRequest& request, TransferTexts& texts) {
    const auto in = [&](CLI::Option* option) { option->group("Input"); };
    in(command.add_option("--source", request.source, "Material photo: PNG, JPEG or EXR"));
    in(command.add_option("--source-mask", request.source_options.mask,
                          "Its object, white on black"));
    in(command.add_option("--source-box", texts.source_box,
                          "x,y,w,h around the object in place of a mask (GrabCut)"));
    in(command.add_option("--material", request.material,
                          "material.json in place of the material photo"));
    in(command.add_option("--target", request.target, "Object photo"));
    in(command.add_option("--target-mask", request.target_options.mask, "Its object"));
    in(command.add_option("--target-box", texts.target_box, "x,y,w,h in place of a mask"));
    in(command.add_option("--target-frames", request.target_frames,
                          "Folder of pictures, each with <name>_mask.png, in place of one"));
    in(command.add_option("--colour-space", texts.colour_space, "Of PNG and JPEG")
           ->check(CLI::IsMember({"srgb", "linear"}))
           ->capture_default_str());
    in(command.add_option("--source-px-per-m", request.source_px_per_m,
                          "Scale of the material photo (px/m)"));
    in(command.add_option("--target-px-per-m", request.target_px_per_m,
                          "Scale of the object photo (px/m); both make the transfer metric"));
    in(command.add_option("--object-size-m", request.object_size_m,
                          "Larger side of the source object (m), in place of its scale"));
    command.add_option("--out", request.out, "Folder for the results")->required()->group("Output");
}

void add_look(CLI::App& command, TransferLook& look, TransferTexts& texts) {
    const auto in = [&](CLI::Option* option) { option->capture_default_str()->group("Look"); };
    in(command.add_option("--scale", look.scale, "Factor on the material's lengths")
           ->check(CLI::Range(0.02, 50.0)));
    in(command.add_option("--exposure", look.exposure, "Factor on the diffuse light"));
    in(command.add_option("--highlight-gain", look.highlight_gain, "Factor on the highlights"));
    in(command.add_option("--highlights", texts.highlights, "How highlights are carried over")
           ->check(CLI::IsMember({"residual", "phong"})));
    in(command.add_option("--phong-exponent", look.phong_exponent, "m of --highlights phong"));
    in(command.add_option("--gloss", look.added_gloss, "Strength of an added highlight"));
    in(command.add_option("--object-albedo", look.object_albedo,
                          "Assumed of the object as photographed; sets the light level"));
    command.add_flag("--free-colour", texts.is_colour_free, "Let --scale change the mean colour")
        ->group("Look");
}

void add_method(CLI::App& command, TransferRequest& request, TransferTexts& texts) {
    const auto in = [&](CLI::Option* option) { option->capture_default_str()->group("Method"); };
    TransferAnalysisOptions& analysis = request.analysis;
    in(command.add_option("--method", texts.method, "`paper`: everything as published")
           ->check(CLI::IsMember({"default", "paper"})));
    in(command.add_option("--lights", texts.lights, "How lights are found")
           ->check(CLI::IsMember({"diffusion", "lopez-moreno"})));
    in(command.add_option("--solver", texts.solver, "How the profile is solved")
           ->check(CLI::IsMember({"monotone", "qmr"})));
    in(command.add_option("--coupling", texts.coupling, "Of the colour channels")
           ->check(CLI::IsMember({"ordered", "free"})));
    in(command
           .add_option("--irradiance", texts.irradiance,
                       "Light on the visible side: read off the photo, or from the lights")
           ->check(CLI::IsMember({"photo", "lights"})));
    in(command
           .add_option("--shape", texts.shape,
                       "Of the material: a cluster of balls where the photo shows one, or always "
                       "one body")
           ->check(CLI::IsMember({"auto", "inflated"})));
    in(command
           .add_option(
               "--refine", analysis.refinement_rounds,
               "Rounds of shape by the lights found and lights again, then the front until its "
               "rendering shows the photo (material photo); 0: none of it")
           ->check(CLI::Range(0, 8)));
    in(command
           .add_option("--transmittance", texts.transmittance,
                       "Of the material's surface; auto: what explains the photo better")
           ->check(CLI::IsMember({"auto", "fresnel", "none"})));
    in(command
           .add_option("--body", texts.body,
                       "Light through a closed body, or the flat profile as published")
           ->check(CLI::IsMember({"curved", "flat"})));
    in(command
           .add_option("--softness", analysis.softness,
                       "1: soft shading is the material's in the material photo and the light's "
                       "in the object photo; 0.5: no opinion")
           ->check(CLI::Range(0.0, 1.0)));
    in(command
           .add_option("--alpha", analysis.relief.alpha, "Weight of shading detail in the shape")
           ->check(CLI::Range(0.0, 1.0)));
    in(command
           .add_option("--sigma-spatial", analysis.relief.sigma_spatial,
                       "Smoothness of the shape (inradii)")
           ->check(CLI::Range(0.005, 0.5)));
    in(command.add_option("--depth", analysis.relief.depth, "Depth of the shape over its width")
           ->check(CLI::Range(0.1, 3.0)));
    in(command
           .add_option("--window-frames", request.window_frames,
                       "Frames over which lights of a sequence are averaged")
           ->check(CLI::Range(1, 99)));
    command
        .add_flag("--object-neutral", analysis.is_object_neutral,
                  "The object is white: its colours are those of the light")
        ->group("Method");
}

void resolve(TransferRequest& request, const TransferTexts& texts, std::uint64_t seed) {
    if (request.source.empty() == request.material.empty())
        throw UsageError("transfer: give either --source or --material");
    if (request.target.empty() == request.target_frames.empty())
        throw UsageError("transfer: give either --target or --target-frames");
    request.source_options.box = parse_box(texts.source_box, "--source-box");
    request.target_options.box = parse_box(texts.target_box, "--target-box");
    request.source_options.is_linear = request.target_options.is_linear =
        texts.colour_space == "linear";
    TransferAnalysisOptions& analysis = request.analysis;
    if (texts.lights == "lopez-moreno") analysis.light_method = LightMethod::LopezMoreno;
    if (texts.solver == "qmr") analysis.bssrdf.solver = ProfileSolver::Qmr;
    if (texts.coupling == "free") analysis.bssrdf.coupling = ChannelCoupling::Free;
    if (texts.irradiance == "lights") request.irradiance = IrradianceSource::Lights;
    if (texts.shape == "inflated") analysis.shape = ShapeModel::Inflated;
    if (texts.transmittance == "fresnel") analysis.bssrdf.transmittance = Transmittance::Fresnel;
    if (texts.transmittance == "none") analysis.bssrdf.transmittance = Transmittance::None;
    analysis.bssrdf.use_curved_body = analysis.lights.use_curved_body = texts.body == "curved";
    if (texts.highlights == "phong") request.look.highlights = HighlightTransfer::Phong;
    request.look.keep_colour = !texts.is_colour_free;
    analysis.lights.seed = analysis.bssrdf.seed = seed + 1;
    if (texts.method == "paper") set_paper_method(request);
}

Json to_json(const TransferSummary& summary) {
    return {{"albedo", summary.albedo},
            {"mean_radius_px", summary.mean_radius_px},
            {"self_psnr_db", summary.self_psnr_db},
            {"flat_psnr_db", summary.flat_psnr_db},
            {"frames", summary.frame_count},
            {"seconds", summary.seconds},
            {"uncertain", summary.is_uncertain},
            {"warnings", summary.warnings}};
}

}  // namespace

void add_transfer_command(CLI::App& root) {
    CLI::App* command = root.add_subcommand(
        "transfer", "Dress the object of one photo in the translucent material of another");
    auto request = std::make_shared<TransferRequest>();
    auto texts = std::make_shared<TransferTexts>();
    add_inputs(*command, *request, *texts);
    add_look(*command, request->look, *texts);
    add_method(*command, *request, *texts);
    const auto common = add_common_options(*command);
    on_run(*command, common, [=] {
        resolve(*request, *texts, common->seed);
        const Progress progress = make_progress(*common, "transfer");
        const TransferSummary summary = request->target_frames.empty()
                                            ? run_transfer(*request, progress)
                                            : run_transfer_sequence(*request, progress);
        if (common->json) {
            fmt::print("{}\n", to_json(summary).dump(2));
        } else {
            for (const std::string& warning : summary.warnings)
                fmt::print("note     {}\n", warning);
            fmt::print(
                "material reflectance {:.3f} {:.3f} {:.3f}, mean distance {:.1f} {:.1f} "
                "{:.1f} px\n",
                summary.albedo[0], summary.albedo[1], summary.albedo[2], summary.mean_radius_px[0],
                summary.mean_radius_px[1], summary.mean_radius_px[2]);
            fmt::print("written to {} in {:.1f} s\n", request->out.string(), summary.seconds);
        }
        return summary.is_uncertain ? kUncertain : kDone;
    });
}

}  // namespace vitrine::cli
