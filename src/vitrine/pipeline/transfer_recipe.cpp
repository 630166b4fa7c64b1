#include "pipeline/transfer_recipe.h"

#include "base/file.h"
#include "base/timer.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "image/pixel_box.h"
#include "pipeline/transfer_report.h"

#include <algorithm>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

/// The material to use and how long its pixels are in the object photo.
struct ReadyMaterial {
    MediumEstimate medium;
    std::optional<LiftedMaterial> lifted;
    double px_per_m = 0;
};

double object_px_per_m(const Mask& mask, double object_size_m) {
    const PixelBox box = PixelBox::of(mask);
    return std::max(box.width(), box.height()) / object_size_m;
}

ReadyMaterial stored_material(const TransferRequest& request) {
    ReadyMaterial ready;
    StoredMaterial stored = read_material_json(request.material);
    ready.medium = std::move(stored.medium);
    ready.px_per_m = request.source_px_per_m > 0 ? request.source_px_per_m : stored.scale_px_per_m;
    return ready;
}

ReadyMaterial lifted_material(const TransferRequest& request, LiftedMaterial lifted) {
    ReadyMaterial ready;
    ready.medium = lifted.medium;
    ready.px_per_m = request.source_px_per_m;
    if (ready.px_per_m <= 0 && request.object_size_m > 0)
        ready.px_per_m = object_px_per_m(lifted.analysis.photo.mask, request.object_size_m);
    ready.lifted = std::move(lifted);
    return ready;
}

void collect(TransferSummary& summary, const std::vector<std::string>& warnings) {
    for (const std::string& warning : warnings) {
        if (std::find(summary.warnings.begin(), summary.warnings.end(), warning) ==
            summary.warnings.end()) {
            summary.warnings.push_back(warning);
        }
    }
}

void collect(TransferSummary& summary, const ReadyMaterial& material) {
    for (std::size_t c = 0; c < 3; ++c) {
        const ChannelFit& channel = material.medium.channels[c];
        summary.albedo[c] = channel.albedo;
        summary.mean_radius_px[c] = channel.mean_radius_px;
        summary.is_uncertain |= channel.outcome != Outcome::Converged;
    }
    collect(summary, material.medium.warnings);
    if (!material.lifted) return;
    summary.self_psnr_db = material.lifted->self_psnr_db;
    summary.flat_psnr_db = material.lifted->flat_psnr_db;
    summary.is_uncertain |= material.lifted->analysis.explaining.outcome != Outcome::Converged;
    collect(summary, material.lifted->analysis.warnings);
}

/// Bit-exact where the picture was not touched: the photo's own codes, where it has 8 bits.
ImageRgb8 finished_codes(const TransferPicture& result, const PhotoAnalysis& target) {
    return linear_to_srgb8(result.picture, static_cast<float>(1 / target.white));
}

TranslucentRenderOptions render_options(const TransferRequest& request) {
    TranslucentRenderOptions options;
    options.eta = request.analysis.bssrdf.eta;
    options.use_curved_body = request.analysis.bssrdf.use_curved_body;
    return options;
}

}  // namespace

void set_paper_method(TransferRequest& request) {
    request.analysis.light_method = LightMethod::LopezMoreno;
    request.analysis.bssrdf.solver = ProfileSolver::Qmr;
    request.analysis.bssrdf.coupling = ChannelCoupling::Free;
    request.analysis.bssrdf.eta = 1.3;
    request.analysis.bssrdf.use_shadows = false;
    request.analysis.bssrdf.use_curved_body = false;
    request.analysis.bssrdf.transmittance = Transmittance::Fresnel;
    request.analysis.lights.use_curved_body = false;
    request.analysis.shape = ShapeModel::Inflated;
    request.analysis.use_back = false;
    request.analysis.relief.alpha = 0.6;
    request.irradiance = IrradianceSource::Lights;
    request.look.highlights = HighlightTransfer::Phong;
    request.look.phong_exponent = 5;
    request.look.highlight_weight = 0.5;
    request.look.use_shadow_maps = true;
}

TransferSummary run_transfer(const TransferRequest& request, const Progress& progress) {
    const Timer timer;
    TransferSummary summary;
    const Photo target_photo = read_photo(request.target, request.target_options);
    ReadyMaterial material;
    PhotoAnalysis target;
    if (!request.material.empty()) {
        material = stored_material(request);
        target = analyse_object(target_photo, request.analysis, progress.part(0.0, 0.8));
    } else {
        const Photo source_photo = read_photo(request.source, request.source_options);
        AnalysedPair pair =
            analyse_pair(source_photo, target_photo, request.analysis, progress.part(0.0, 0.8));
        material = lifted_material(request, std::move(pair.material));
        target = std::move(pair.object);
    }
    collect(summary, material);
    summary.is_uncertain |= target.lights.outcome == Outcome::NotIdentifiable;
    collect(summary, target.warnings);

    TransferLook look = request.look;
    if (target.highlights.blobs.empty()) {
        collect(summary, {target_photo.name +
                          ": no highlight found, as on a matte object; gloss can be added "
                          "(--gloss 0.3)."});
    }
    const TransferSession session(target, request.irradiance, render_options(request),
                                  request.analysis.is_object_neutral, look.object_albedo);
    const double ratio = length_ratio(material.medium.inradius_px, target.relief.inradius_px,
                                      material.px_per_m, request.target_px_per_m);
    const TransferPicture result = session.render(material.medium.profile().scaled(ratio), look);
    progress.update(0.9, "writing");

    std::error_code error;
    fs::create_directories(request.out, error);
    if (error) {
        throw MachineError(
            fmt::format("{}: cannot be made: {}", request.out.string(), error.message()));
    }
    write_png(request.out / "transfer.png", finished_codes(result, target));
    write_exr(request.out / "transfer.exr", result.picture);
    write_material_json(request.out / "material.json", material.medium, material.px_per_m);
    write_relief_exr(request.out / "relief_target.exr", target.relief);
    write_lights_json(request.out / "lights_target.json", target);
    if (material.lifted) {
        write_relief_exr(request.out / "relief_source.exr", material.lifted->analysis.relief);
        write_lights_json(request.out / "lights_source.json", material.lifted->analysis);
    }
    summary.seconds = timer.seconds();
    write_transfer_report(request.out / "report.html",
                          material.lifted ? &*material.lifted : nullptr, material.medium, target,
                          result, summary);
    progress.update(1.0, "done");
    return summary;
}

}  // namespace vitrine
