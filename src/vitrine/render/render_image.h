// render/render_image.h: a whole picture of a scene.
#pragma once

#include "base/progress.h"
#include "render/caustics.h"
#include "render/path_tracer.h"

#include <optional>

namespace vitrine {

struct FinalOptions {
    int samples_per_pixel = 64;     ///< everywhere
    int max_samples_per_pixel = 0;  ///< where the picture is noisy; 0: no more than everywhere
    double noise_target = 0.01;     ///< standard error wanted there, of the pixel's own level
    /// Paths per pixel that look for soft light, which is then averaged over neighbours (see
    /// soft_light.h); may be below one. 0: all paths do and nothing is averaged, as a reference.
    double soft_samples_per_pixel = 0;
    /// Paths of each pixel, of the camera's size: takes the place of the three numbers above.
    const Image<int>* samples = nullptr;
    bool use_photons = true;          ///< false: the reference path tracer alone
    int pass_photon_count = 500'000;  ///< photons of a progressive pass; more of them, more passes
    /// `gather_radius_m` is that of the first pass; 0: half a pixel's width at the scene's centre.
    CausticOptions caustics;
    PathOptions paths;
    std::uint64_t seed = 0;
};

/// For a picture to be looked at: most paths where it is noisy, soft light averaged, first photons
/// gathered within half a pixel's width.
FinalOptions picture_options();

struct RenderedImage {
    ImageRgb radiance;  ///< linear, W/(m2 sr)
    ImageF variance;    ///< of the luminance of each pixel's mean, from the spread of its samples;
                        ///< without that of soft light which is averaged
};

/// What the camera sees straight ahead of each pixel's centre; no depth (0) where it meets nothing.
struct Geometry {
    ImageF z_m;       ///< planar depth
    ImageRgb normal;  ///< shading normal in the world, towards the camera
    ImageRgb albedo;  ///< diffuse albedo; rho_d of metals, zero for glass and mirrors
    Image<int> part;  ///< index of the part, -1 where nothing is met
};
Geometry render_geometry(const RenderScene& scene, const Camera& camera,
                         std::uint32_t view = kAllParts);

/// Gather radius that about matches a pixel of the camera: half its width at the distance of the
/// parts that a caustic can fall on.
double pixel_radius(const RenderScene& scene, const Camera& camera);

/// Box filter of one pixel. The same bits for any number of threads. Costs about 1 us per sample
/// and bounce and core. Photons come in passes of shrinking radius, each with its share of the
/// paths, so that memory is that of one pass; the picture is the mean of the passes.
RenderedImage render_image(const RenderScene& scene, const Camera& camera,
                           const FinalOptions& options = {}, const Progress& progress = {});
/// With photons traced before, e.g. for several cameras: fixed radius.
RenderedImage render_image(const RenderScene& scene, const Camera& camera,
                           const CausticMaps* caustics, const FinalOptions& options = {},
                           const Progress& progress = {});

}  // namespace vitrine
