// render/translucent_light.h: the light leaving the translucent bodies of a scene, with and without
// its virtual parts.
#pragma once

#include "base/progress.h"
#include "render/render_scene.h"

namespace vitrine {

struct CausticMaps;
struct PathOptions;

struct TranslucentLightOptions {
    int paths_per_sample = 32;  ///< the profile averages over dozens of samples more
    int rounds = 2;             ///< the second lets bodies see each other and what they light
    std::uint64_t seed = 0;
};

/// B of each body at its samples, less what is left to paint (render/translucent_body.h).
class TranslucentLight {
  public:
    struct Body {
        std::vector<Rgb> with, without;  ///< W/m2 below the interface; `without`: empty when equal
        bool is_touched = false;         ///< a virtual part had a say in it
    };

    TranslucentLight() = default;
    explicit TranslucentLight(std::vector<Body> bodies) : bodies_(std::move(bodies)) {}

    /// At a surface point of part `point.part`, W/m2; zero for parts that are not translucent.
    Rgb exitance(const RenderScene& scene, const ShadingPoint& point, std::uint32_t view) const;
    bool is_touched(int part) const {
        return !bodies_.empty() && bodies_[static_cast<std::size_t>(part)].is_touched;
    }

  private:
    std::vector<Body> bodies_;  // per part of the scene
};

/// Finds what enters every translucent body at its samples, by paths like those from a camera:
/// shadow rays to all lights, environment, light from other surfaces, photons that land on the
/// body; then what leaves. Samples pressed against or sunk into an opaque part get none.
///
/// Both scenes share random numbers: `with` and `without` are bitwise equal where no virtual part
/// is in play. The same bits on any number of threads. Costs about 0.1 ms per sample and round.
/// @param caustics null: the paths find that light themselves, as in the reference renderer
TranslucentLight light_translucent_bodies(const RenderScene& scene, const CausticMaps* caustics,
                                          const PathOptions& paths,
                                          const TranslucentLightOptions& options = {},
                                          const Progress& progress = {});

}  // namespace vitrine
