// pipeline/transfer_recipe.h: half B from files to files.
#pragma once

#include "compose/transfer.h"

#include <array>
#include <filesystem>

namespace vitrine {

struct TransferRequest {
    std::filesystem::path source;    ///< material photo
    std::filesystem::path material;  ///< material.json in its place
    PhotoOptions source_options;
    std::filesystem::path target;  ///< object photo
    PhotoOptions target_options;
    std::filesystem::path target_frames;  ///< folder of pictures (and <stem>_mask.png) in its place
    std::filesystem::path out;

    TransferAnalysisOptions analysis;
    IrradianceSource irradiance = IrradianceSource::Photo;
    TransferLook look;
    double source_px_per_m = 0;  ///< 0: unknown
    double target_px_per_m = 0;
    double object_size_m = 0;  ///< larger side of the source object's box; gives source_px_per_m
    int window_frames = 5;     ///< of a sequence, over which lights are averaged
};

/// Sets what the published method does where ours differs: Lopez-Moreno lights, QMR on the normal
/// equations with exponentials through the steps, free channels, lights on both sides, Phong lobe
/// m = 5 on H with weights 0.5 / 0.5, no shadows.
void set_paper_method(TransferRequest& request);

struct TransferSummary {
    std::array<double, 3> albedo{}, mean_radius_px{};
    double self_psnr_db = 0, flat_psnr_db = 0;  ///< 0 with a ready material
    double seconds = 0;
    bool is_uncertain = false;  ///< a quantity is at a bound or not identifiable: exit code 4
    std::vector<std::string> warnings;
    int frame_count = 1;
};

/// Writes transfer.png, transfer.exr, material.json, relief_{source,target}.exr,
/// lights_{source,target}.json and report.html to `out`, each atomically.
/// @throws InputError, MachineError
TransferSummary run_transfer(const TransferRequest& request, const Progress& progress = {});

/// The same material on every picture of `target_frames`: R_d frozen, lights and light level
/// averaged over a window of frames. Writes frames/<stem>.png. See docs/translucency.md.
TransferSummary run_transfer_sequence(const TransferRequest& request,
                                      const Progress& progress = {});

/// material.json, "vitrine.translucent/1" (interfaces: profile, fit, eta, inradius, scale, dipole).
void write_material_json(const std::filesystem::path& path, const MediumEstimate& medium,
                         double scale_px_per_m);

/// A material read back: enough to dress an object.
struct StoredMaterial {
    MediumEstimate medium;
    double scale_px_per_m = 0;  ///< 0: unknown
};
StoredMaterial read_material_json(const std::filesystem::path& path);

void write_lights_json(const std::filesystem::path& path, const PhotoAnalysis& analysis);
/// Planes Z (pixels, viewer frame) and normal.X .Y .Z.
void write_relief_exr(const std::filesystem::path& path, const Relief& relief);

}  // namespace vitrine
