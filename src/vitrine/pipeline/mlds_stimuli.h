// pipeline/mlds_stimuli.h: renders the series of pictures that a difference-scaling study shows.
#pragma once

#include "base/progress.h"
#include "perception/scale_json.h"
#include "scene/scene.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vitrine {

/// A scene, the part whose index varies, and the indices.
struct SeriesSpec {
    std::string title;
    Scene scene;
    std::string part;
    std::vector<double> ior;
};

/// Reads "vitrine.mlds_series/1": {"title", "scene" (a file inside the folder), "part", "ior": a
/// list, or {"from", "to", "count"}}.
/// @throws InputError for a part that does not exist or is no dielectric, indices out of (1, 3].
SeriesSpec read_series_spec(const std::filesystem::path& path);
void check_series(const SeriesSpec& spec, const std::string& where);

struct StimuliOptions {
    bool use_photons = true;  ///< false: path tracing alone, for lights that have a size
    int samples_per_pixel = 16;
    std::uint64_t photon_count = 4'000'000;
    double gather_radius_m =
        0.0006;               ///< of photons; 1.5 pixels of the presets, whose eye blurs as much
    int diffuse_bounces = 0;  ///< of lamp light, beyond the surface seen; each adds noise, and a
                              ///< table alone sends next to none back to itself
    int size_px = 0;          ///< side of the square pictures; 0: the camera's own size
    double exposure = 0.0;    ///< radiance to display factor; 0: chosen, one for all pictures
    std::uint64_t seed = 0;   ///< the same for all pictures, so that noise is no difference
};

/// Renders one picture per index into `folder`: stimulus_NN.png (sRGB), stimulus_NN.exr (linear,
/// exposed) and stimuli.json. One more render with another seed measures the noise. Lamps and the
/// light from all around are rendered apart and added: paths that happen on a caustic while they
/// look for the environment are what makes such pictures noisy.
/// @throws InputError when path tracing is asked of point or spot lights, which no path can find
/// through glass.
StimulusSeries render_stimuli(const SeriesSpec& spec, const std::filesystem::path& folder,
                              const StimuliOptions& options = {}, const Progress& progress = {});

/// The linear pictures of a rendered series, for the computational observer.
std::vector<ImageRgb> read_linear_stimuli(const std::filesystem::path& folder,
                                          const StimulusSeries& series);

}  // namespace vitrine
