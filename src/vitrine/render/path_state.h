// render/path_state.h: a path under way, and where its contributions go. For the files of
// `PathTracer` alone.
#pragma once

#include "render/path_tracer.h"

namespace vitrine {

// Uses of a vertex's random numbers.
constexpr int kBranchUse = 1;
constexpr int kScatterUse = 2;
constexpr int kLobeUse = 3;
constexpr int kPickUse = 4;
constexpr int kRouletteUse = 5;
constexpr int kLightUse = 6;  // and one more per light, eight at most
constexpr int kSecondaryUse = 15;

struct PathTracer::State {
    Vec3f origin, direction;
    Rgb throughput = Rgb::Ones();
    Media media;
    int depth = 0;  // vertices so far
    int diffuse_bounces = 0;
    int specular_bounces = 0;
    bool has_receiver = false;      // left a surface that photons are stored on
    bool is_first_receiver = true;  // the next receiver is the one seen
    /// Light met now is known from the photons of the last receiver.
    bool is_covered = false;
    Layer layer = Layer::Shadow;
    bool is_layer_fixed = false;      // seen by way of a reflection or refraction
    bool is_from_first = false;       // left the surface seen by its diffuse lobe
    bool is_diffuse_segment = false;  // straight from a receiver's diffuse lobe
    bool is_soft = false;             // what comes now is soft light of the surface seen
    float pdf = 0;  // of `direction` at the last receiver; 0 for single directions
    Vec3f receiver = Vec3f::Zero();
    std::uint32_t views = kVirtualParts;  // scenes whose path this is
    bool is_fresh = true;                 // the camera ray
};

/// Where contributions go: all to the first result until the two scenes differ.
struct PathTracer::Sink {
    PathResult& with;
    PathResult& without;
    bool is_touched = false;

    /// What comes now differs between the scenes.
    void part() {
        if (is_touched) return;
        without = with;
        is_touched = true;
    }
    /// Calls `body(result)` for those of the scenes `views`.
    template <typename Body>
    void each(std::uint32_t views, const Body& body) {
        if (!is_touched || (views & kVirtualParts)) body(with);
        if (is_touched && (views & kRealParts)) body(without);
    }
    void add(const State& state, Layer layer, const Rgb& radiance, std::uint32_t views) {
        each(views, [&](PathResult& result) {
            if (!state.is_soft) {
                result.layers[static_cast<std::size_t>(layer)] += radiance;
            } else {
                (layer == Layer::Shadow ? result.soft.shadow : result.soft.diffuse) += radiance;
            }
        });
    }
    /// One that is there in the scenes `views` alone, of those of the path.
    void add_in(std::uint32_t views, const State& state, Layer layer, const Rgb& radiance) {
        if (views != state.views) part();
        add(state, layer, radiance, views);
    }
};

/// What rays of a path meet that belongs to the scenes `views`, see PathTracer::entering.
inline std::uint32_t mask_of(std::uint32_t views) {
    return views & kVirtualParts ? kAllParts : kRealParts;
}

}  // namespace vitrine
