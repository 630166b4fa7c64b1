// benchmarks/quality/rerendered_truth.h: the truth's pictures as its own renderer makes them with
// many more paths (cycles_truth.py), to tell our errors from the truth's noise.
#pragma once

#include "insert_regions.h"

#include <optional>
#include <string>

namespace vitrine {

/// Mean over the seeds (FOLDER/seed_K/NAME.exr).
struct RerenderedPicture {
    ImageRgb mean;       ///< the given picture where nothing was rendered
    ImageRgb even, odd;  ///< of every other seed: half of what differs is the mean's noise
    Mask known;          ///< pixels that were rendered, by all seeds
    int seeds = 0;
};

/// @param name id of the frame, with "_with" when the virtual object is there
/// @return none where fewer than two seeds have the picture
std::optional<RerenderedPicture> read_rerendered(const std::filesystem::path& folder,
                                                 const std::string& name, const ImageRgb& given);

/// Prints per region, over pixels well inside of what was rendered again: our error and the
/// rerendered picture's own against the given truth, ours against the rerendered one, its noise,
/// and how much changes on average.
/// @param folder of the rerendered pictures
/// @param name of our picture
/// @param ours blurred change
/// @param second with other random numbers; null: our noise is not known
void compare_rerendered(const std::filesystem::path& folder, const TrueFrame& given,
                        const char* name, const ImageRgb& ours, const ImageRgb* second, float top);

}  // namespace vitrine
