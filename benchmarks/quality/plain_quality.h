// benchmarks/quality/plain_quality.h: renders of a capture's true scene, as it is, beside its true
// pictures.
#pragma once

#include "render/caustic_maps.h"
#include "render/differential.h"
#include "render_truth.h"

#include <string>
#include <vector>

namespace vitrine {

struct RenderQualityOptions {
    std::string capture;
    std::string insert = "insert";
    std::string out;
    int samples = 16;
    double crease_deg = kCreaseDeg, object_crease_deg = kCreaseDeg;
    bool has_second_seed = false;
    int path_samples = 0;
    std::string rerendered;   ///< folder of the truth rendered again; empty: none
    std::vector<int> window;  ///< x, y, width, height of the picture of paths; empty: all of it
    std::vector<std::string> frames;
    DifferentialOptions differential;

    bool takes(const std::string& frame) const {
        return frames.empty() || std::find(frames.begin(), frames.end(), frame) != frames.end();
    }
};

/// Side by side, as PNG.
/// @param scale radiance shown as full white
void write_side_by_side(const std::filesystem::path& path, const std::vector<ImageRgb>& images,
                        double scale);

/// Prints, per frame with a true picture: the mean relative error off glass, metal and caustics,
/// and the caustic's flux and correlation.
void compare_plain(const RenderQualityOptions& options, const TruthScene& truth,
                   const RenderScene& scene, const CausticMaps& maps);

}  // namespace vitrine
