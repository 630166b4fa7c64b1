// render/differential.h: what a virtual object changes in a picture (differential rendering,
// Debevec 1998), split by cause.
//
// The scene with the object and the one without share photons and random numbers, and a path that
// never meets the object is traced once for both: where nothing changed the difference is exactly
// zero, and the noise that remains is that of the change alone.
#pragma once

#include "render/render_image.h"

#include <memory>
#include <span>

namespace vitrine {

struct DifferentialOptions {
    int min_samples = 4;       ///< paths per pixel everywhere, enough to see where work is needed
    int min_soft_samples = 2;  ///< those that go on from plain surfaces, see soft_light.h
    int max_samples = 40;      ///< paths per pixel where the change is noisy
    /// Standard error per pixel, of its own luminance or the picture's mean, whichever is brighter.
    double noise_target = 0.008;
    std::uint64_t photon_count = 3'000'000;
    int photon_passes = 4;  ///< sets they come in, each with a smaller radius than the one before
    double gather_radius_m = 0;  ///< of the first; 0: half the width of a pixel (`pixel_radius`)
    PathOptions paths;
    std::uint64_t seed = 0;
};

/// For looking while an object is moved: a frame of 640x360 in about two seconds of processor time
/// beside a world that is kept. One bounce, few photons, grain in soft shadows.
DifferentialOptions preview_options();

/// All radiances linear; one camera. Composite: (1 - coverage) * (plate + delta) + object.
struct DifferentialImage {
    ImageRgb with;     ///< the rendered scene with the virtual objects
    ImageRgb without;  ///< the same without them, same random numbers
    /// delta = shadow + caustics + reflection + refraction + diffuse: change of the real surfaces
    /// that stay visible, averaged over the uncovered part of the pixel. May be negative.
    ImageRgb shadow, caustics, reflection, refraction, diffuse;
    ImageRgb object;    ///< radiance of the virtual surfaces seen directly, times coverage
    ImageF coverage;    ///< share of the pixel covered by them, antialiased
    Geometry geometry;  ///< of the scene with the objects, at pixel centres
    ImageRgb delta() const;
};

class DifferentialRenderer {
  public:
    /// Traces the photons once for all cameras.
    /// @param real scene without virtual parts: estimated materials and lights
    /// @param virtual_parts in the world; `is_virtual` is set here
    /// @param cameras those to be rendered; they set the gather radius
    DifferentialRenderer(Scene real, std::vector<Part> virtual_parts,
                         std::span<const Camera> cameras, const DifferentialOptions& options = {},
                         const Progress& progress = {});

    /// The same beside a world that was made ready before, and is shared: for objects that move.
    DifferentialRenderer(const RenderScene& world, std::vector<Part> virtual_parts,
                         std::span<const Camera> cameras, const DifferentialOptions& options = {},
                         const Progress& progress = {});

    DifferentialImage render(const Camera& camera, const Progress& progress = {}) const;

    const RenderScene& scene() const { return scene_; }
    const PhotonBalance& photon_balance() const { return balance_; }

  private:
    void trace_photons(std::span<const Camera> cameras, const Progress& progress);

    RenderScene scene_;
    std::vector<CausticMaps> maps_;  // of the progressive passes
    TranslucentLight translucent_;
    PhotonBalance balance_;
    DifferentialOptions options_;
};

}  // namespace vitrine
