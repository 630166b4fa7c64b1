// pipeline/series_renderer.h: pictures of one scene whose glass changes, nearly without noise.
#pragma once

#include "base/progress.h"
#include "pipeline/mlds_series.h"
#include "render/render_image.h"

#include <cstdint>

namespace vitrine {

struct StimuliOptions {
    bool use_photons = true;    ///< false: path tracing alone, for lights that have a size
    int samples_per_pixel = 4;  ///< of every pixel, for each kind of light; noisy ones get more
    int max_samples_per_pixel = 32;
    double deviation_l = 0.2;  ///< standard deviation of L* at which a pixel has enough
    std::uint64_t photon_count = 1'200'000;  ///< per picture
    double gather_radius_m = 0.0006;  ///< of photons; 1.5 pixels of the presets, whose eye blurs as
                                      ///< much; 0: half a pixel's width
    double smooth_px = 2.5;  ///< sigma of the blur of light from evenly all around on flat surfaces
                             ///< of one colour, where it varies slowly; 0: none
    int diffuse_bounces = 0;  ///< of lamp light, beyond the surface seen; each adds noise, and a
                              ///< table alone sends next to none back to itself
    int size_px = 0;          ///< width of the pictures; 0: the camera's own size
    double exposure = 0.0;    ///< radiance to display factor; 0: chosen, one for all pictures
    std::uint64_t seed = 0;   ///< the same for all pictures, so that noise is no difference
};

/// Renders the pictures of one series, all with the same random numbers and as many in each pixel.
///
/// Lamps and the light from all around are rendered apart and added: paths that happen on a caustic
/// while they look for the environment are what makes such pictures noisy.
class SeriesRenderer {
  public:
    /// Deals out the samples on the middle picture; costs about as much as that.
    /// @throws InputError when path tracing is asked of point or spot lights, which no path can
    /// find through glass, and for black pictures.
    SeriesRenderer(const SeriesSpec& spec, const StimuliOptions& options,
                   const Progress& progress = {});

    /// The picture with the varied part at `ior`, exposed: 1 is the display's white.
    ImageRgb render(double ior, const Progress& progress = {}) const;
    /// The same plan, exposure and counts of samples with other random numbers: what pictures of
    /// both differ by is noise.
    SeriesRenderer with_seed(std::uint64_t seed) const;

    double exposure() const { return exposure_; }
    /// Paths per pixel for the light of the lamps and for that from all around.
    const Image<int>& lamp_samples() const { return lamp_samples_; }
    const Image<int>& surroundings_samples() const { return surroundings_samples_; }

  private:
    void plan(const Scene& scene, const Progress& progress);
    RenderedImage render_lamps(const Scene& scene, const Progress& progress) const;
    RenderedImage render_surroundings(const Scene& scene, const Progress& progress) const;
    void smooth(ImageRgb& picture) const;

    SeriesSpec spec_;
    StimuliOptions options_;
    Camera camera_;
    double exposure_ = 0;
    Image<int> lamp_samples_, surroundings_samples_;  // empty until planned
    Image<int> plain_;  // part of one colour that alone fills the pixel, else -1
    ImageRgb normal_;   // of the surface seen
};

}  // namespace vitrine
