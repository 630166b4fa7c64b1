// benchmarks/quality/insert_regions.h: the true change that a virtual object makes, the regions it
// falls into and errors over them, as the captures' README measures them.
#pragma once

#include "geometry/camera.h"
#include "image/image.h"

#include <filesystem>

namespace vitrine {

constexpr double kBlurPx = 2.0;

/// Clipped as the camera does, then with - without.
ImageRgb raw_difference(const ImageRgb& with, const ImageRgb& without, float top);

/// Variance of the pixel noise of `error`, from how each pixel differs from its four neighbours
/// (what is smooth drops out), and what the blur leaves of it.
ImageRgb blurred_noise_variance(const ImageRgb& error);

/// Errors over a region, relative to the true change in it.
struct RegionError {
    double error = 0;
    double floor = 0;  ///< the truth's noise far from any change
    double noise = 0;  ///< that of both pictures within the region
    double power = 0;  ///< of the true change
    std::size_t count = 0;
};
RegionError region_error(const ImageRgb& truth, const ImageRgb& estimate, double noise_rms,
                         const ImageRgb& noise_variance, const Mask& inside);

/// Where the estimate says that nothing changed: root mean square of the true difference, which is
/// the truth's noise, and what neighbouring pixels say of that noise.
struct FarNoise {
    double rms = 0, by_neighbours = 0;
};
FarNoise far_noise(const ImageRgb& truth, const ImageRgb& raw_truth, const ImageRgb& estimate,
                   double level);

/// One frame: pictures of the change and the regions it falls into.
struct TrueFrame {
    Camera camera;
    ImageRgb plate, with;  // of the truth
    ImageRgb raw_true, d_true;
    double level = 0;
    Mask virtual_mask;  // pixels that show the virtual object
    Mask regions[4];    // see kRegionNames
};
inline constexpr const char* kRegionNames[4] = {"object", "darker", "brighter", "all"};

TrueFrame make_frame(const Camera& camera, const ImageRgb& plate, const ImageRgb& with,
                     const Mask& virtual_mask, float top);

/// @param folder of the insertion's truth
TrueFrame read_frame(const std::filesystem::path& folder, const Camera& camera, float top);

}  // namespace vitrine
