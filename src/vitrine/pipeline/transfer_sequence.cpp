#include "base/timer.h"
#include "image/colour.h"
#include "image/image_io.h"
#include "pipeline/transfer_recipe.h"

#include <algorithm>
#include <deque>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

/// Pictures of the folder in order of name, each with its mask <stem>_mask.png.
std::vector<fs::path> list_frames(const fs::path& folder) {
    if (!fs::is_directory(folder))
        throw InputError({folder.string(), "a folder of pictures", "no folder", ""});
    std::vector<fs::path> frames;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        const std::string stem = entry.path().stem().string();
        const bool is_picture = extension == ".png" || extension == ".jpg" ||
                                extension == ".jpeg" || extension == ".exr";
        if (!is_picture || stem.ends_with("_mask")) continue;
        frames.push_back(entry.path());
    }
    std::sort(frames.begin(), frames.end());
    if (frames.empty())
        throw InputError({folder.string(), "pictures with masks <name>_mask.png", "none", ""});
    return frames;
}

/// The mean of several sets of lights: all of them, each at its share. No matching, no jumps.
ViewLights mean_lights(const std::deque<PhotoAnalysis>& window) {
    ViewLights pooled;
    const double share = 1.0 / static_cast<double>(window.size());
    for (const PhotoAnalysis& frame : window) {
        for (ViewLight light : frame.lights.lights.lights) {
            light.intensity *= share;
            pooled.lights.push_back(light);
        }
        pooled.ambient += frame.lights.lights.ambient * share;
        pooled.from_below += frame.lights.lights.from_below * share;
    }
    return pooled;
}

}  // namespace

TransferSummary run_transfer_sequence(const TransferRequest& request, const Progress& progress) {
    const Timer timer;
    TransferSummary summary;
    const std::vector<fs::path> frames = list_frames(request.target_frames);
    MediumEstimate medium;
    double source_px_per_m = request.source_px_per_m;
    if (!request.material.empty()) {
        StoredMaterial stored = read_material_json(request.material);
        medium = std::move(stored.medium);
        if (source_px_per_m <= 0) source_px_per_m = stored.scale_px_per_m;
    } else {
        const Photo photo = read_photo(request.source, request.source_options);
        const LiftedMaterial lifted =
            lift_material(photo, request.analysis, progress.part(0.0, 0.2));
        medium = lifted.medium;
        summary.self_psnr_db = lifted.self_psnr_db;
        summary.flat_psnr_db = lifted.flat_psnr_db;
        summary.warnings = lifted.medium.warnings;
    }
    for (std::size_t c = 0; c < 3; ++c) {
        summary.albedo[c] = medium.channels[c].albedo;
        summary.mean_radius_px[c] = medium.channels[c].mean_radius_px;
    }
    const fs::path out = request.out / "frames";
    std::error_code error;
    fs::create_directories(out, error);
    if (error)
        throw MachineError(fmt::format("{}: cannot be made: {}", out.string(), error.message()));
    write_material_json(request.out / "material.json", medium, source_px_per_m);

    TranslucentRenderOptions render_options;
    render_options.eta = request.analysis.bssrdf.eta;
    render_options.use_curved_body = request.analysis.bssrdf.use_curved_body;
    // The scale is that of the first frame: an object that comes closer keeps its material.
    double ratio = 0;
    std::deque<PhotoAnalysis> window;
    std::size_t next = 0, first = 0;
    const auto half = static_cast<std::size_t>(std::max(0, request.window_frames / 2));
    for (std::size_t current = 0; current < frames.size(); ++current) {
        for (; next < frames.size() && next <= current + half; ++next) {
            PhotoOptions options = request.target_options;
            options.mask =
                frames[next].parent_path() / (frames[next].stem().string() + "_mask.png");
            window.push_back(analyse_object(read_photo(frames[next], options), request.analysis));
        }
        while (first + half < current) {
            window.pop_front();
            ++first;
        }
        PhotoAnalysis frame = window[current - first];
        frame.lights.lights = mean_lights(window);
        if (ratio == 0) {
            ratio = length_ratio(medium.inradius_px, frame.relief.inradius_px, source_px_per_m,
                                 request.target_px_per_m);
        }
        const double white = frame.white;
        const TransferSession session(std::move(frame), request.irradiance, render_options,
                                      request.analysis.is_object_neutral,
                                      request.look.object_albedo);
        const TransferPicture result = session.render(medium.profile().scaled(ratio), request.look);
        write_png(out / (frames[current].stem().string() + ".png"),
                  linear_to_srgb8(result.picture, static_cast<float>(1 / white)));
        progress.update(
            0.2 + 0.8 * static_cast<double>(current + 1) / static_cast<double>(frames.size()),
            frames[current].filename().string());
    }
    summary.frame_count = static_cast<int>(frames.size());
    summary.seconds = timer.seconds();
    return summary;
}

}  // namespace vitrine
