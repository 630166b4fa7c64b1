// render/path_state.h: paths under way, and where their contributions go. For the files of
// `PathTracer` alone.
#pragma once

#include "render/path_tracer.h"
#include "render/plain_lanes.h"

#include <vector>

namespace vitrine {

// Uses of a vertex's random numbers.
constexpr int kBranchUse = 1;
constexpr int kScatterUse = 2;
constexpr int kLobeUse = 3;
constexpr int kPickUse = 4;
constexpr int kRouletteUse = 5;
constexpr int kLightUse = 6;  // and one more per light, eight at most
constexpr int kSecondaryUse = 15;

inline std::uint32_t light_use(std::size_t light) {
    return kLightUse + static_cast<std::uint32_t>(std::min<std::size_t>(light, 8));
}

struct PathTracer::State {
    std::uint32_t path = 0;  // whose task and result
    Vec3f origin, direction;
    Rgb throughput = Rgb::Ones();
    Vec3f receiver = Vec3f::Zero();
    float pdf = 0;  // of `direction` at the last receiver; 0 for single directions
    Media media;
    std::int16_t depth = 0;  // vertices so far
    std::int16_t diffuse_bounces = 0;
    std::int16_t specular_bounces = 0;
    std::uint8_t views = kVirtualParts;  // scenes whose path this is
    Layer layer = Layer::Shadow;
    bool has_receiver = false;      // left a surface that photons are stored on
    bool is_first_receiver = true;  // the next receiver is the one seen
    /// Light met now is known from the photons of the last receiver.
    bool is_covered = false;
    bool is_layer_fixed = false;      // seen by way of a reflection or refraction
    bool is_from_first = false;       // left the surface seen by its diffuse lobe
    bool is_diffuse_segment = false;  // straight from a receiver's diffuse lobe
    bool is_soft = false;             // what comes now is soft light of the surface seen
};

/// Where the contributions of a path go: all to the first result until the two scenes differ.
struct PathTracer::Sink {
    PathPair& pair;

    /// What comes now differs between the scenes.
    void part() {
        if (pair.is_touched_) return;
        pair.without_ = pair.with_;
        pair.is_touched_ = true;
    }
    /// Calls `body(result)` for those of the scenes `views`.
    template <typename Body>
    void each(std::uint32_t views, const Body& body) {
        if (!pair.is_touched_ || (views & kVirtualParts)) body(pair.with_);
        if (pair.is_touched_ && (views & kRealParts)) body(pair.without_);
    }
    void add(bool is_soft, Layer layer, const Rgb& radiance, std::uint32_t views) {
        each(views, [&](PathResult& result) {
            if (!is_soft) {
                result.layers[static_cast<std::size_t>(layer)] += radiance;
            } else {
                (layer == Layer::Shadow ? result.soft.shadow : result.soft.diffuse) += radiance;
            }
        });
    }
    void add(const State& state, Layer layer, const Rgb& radiance) {
        add(state.is_soft, layer, radiance, state.views);
    }
    /// One that is there in the scenes `views` alone, of those of the path.
    void add_in(std::uint32_t views, const State& state, Layer layer, const Rgb& radiance) {
        if (views != state.views) part();
        add(state.is_soft, layer, radiance, views);
    }
};

/// Light that arrives if nothing is in its way.
struct PathTracer::ShadowRay {
    Rgb light;
    std::uint32_t path;
    std::uint8_t path_views;
    std::uint8_t views;  // scenes, of those of the path, in which the light is there
    Layer layer;
    bool is_soft;
};

/// A path that met a plain diffuse surface.
struct PathTracer::PlainHit {
    State* state;
    const Hit* hit;
};

/// Paths that go on side by side, one surface at a time: rays are sent one after the other, with
/// nothing in between that drives Embree's data out of the nearest caches.
struct PathTracer::Wave {
    Wave() = default;
    Wave(std::span<const PathTask> its_tasks, std::span<PathPair> its_results)
        : tasks(its_tasks), results(its_results) {}

    std::span<const PathTask> tasks;
    std::span<PathPair> results;
    std::vector<State> states, next;
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    // Met in the scene without virtual parts alone, by paths that were those of both.
    std::vector<State> parted;
    std::vector<Hit> parted_hits;
    std::vector<PlainHit> plain;  // of `states` and `parted`, in the order in which they came
    PlainLanes lanes = {};
    std::vector<ShadowRay> shadows;
    std::vector<Ray> shadow_rays;  // of `shadows`
    std::vector<std::uint8_t> hidden;
    std::vector<int> shadow_lanes;  // of the last shadow rays

    const PathTask& task(const State& state) const { return tasks[state.path]; }
    Sink sink(const State& state) const { return {results[state.path]}; }
    void add_shadow(const State& state, std::uint32_t views, Layer layer, const Rgb& light,
                    Ray ray);
    /// Puts the shadow rays from `first` on, of `shadow_lanes`, in the order of their lanes.
    void sort_shadows(std::size_t first, int lane_count);
};

/// What rays of a path meet that belongs to the scenes `views`, see PathTracer::entering.
inline std::uint32_t mask_of(std::uint32_t views) {
    return views & kVirtualParts ? kAllParts : kRealParts;
}

inline void PathTracer::Wave::add_shadow(const State& state, std::uint32_t views, Layer layer,
                                         const Rgb& light, Ray ray) {
    ray.mask = mask_of(views);
    shadow_rays.push_back(ray);
    shadows.push_back(
        {light, state.path, state.views, static_cast<std::uint8_t>(views), layer, state.is_soft});
}

}  // namespace vitrine
