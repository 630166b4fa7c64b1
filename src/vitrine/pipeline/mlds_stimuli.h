// pipeline/mlds_stimuli.h: renders the series of pictures that a difference-scaling study shows.
#pragma once

#include "perception/scale_json.h"
#include "pipeline/series_renderer.h"

namespace vitrine {

/// Renders one picture per index into `folder`: stimulus_NN.png (sRGB), stimulus_NN.exr (linear,
/// exposed) and stimuli.json. Two pictures in the middle of the series are rendered with another
/// seed as well and measure the noise.
/// @throws InputError as `SeriesRenderer`
StimulusSeries render_stimuli(const SeriesSpec& spec, const std::filesystem::path& folder,
                              const StimuliOptions& options = {}, const Progress& progress = {});

/// The linear pictures of a rendered series, for the computational observer.
std::vector<ImageRgb> read_linear_stimuli(const std::filesystem::path& folder,
                                          const StimulusSeries& series);

}  // namespace vitrine
