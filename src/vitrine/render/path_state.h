// render/path_state.h: paths under way, and where their contributions go. For the files of
// `PathTracer` alone.
#pragma once

#include "render/glass_lanes.h"
#include "render/medium_table.h"
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

template <typename T>
std::size_t lane(T i) {
    return static_cast<std::size_t>(i);
}

/// Calls `body(items)` for as many at a time as there are lanes.
template <typename Item, typename Body>
void for_each_batch(const std::vector<Item>& items, const Body& body) {
    const std::span<const Item> all(items);
    for (std::size_t begin = 0; begin < all.size(); begin += kLanes) {
        body(all.subspan(begin, std::min<std::size_t>(kLanes, all.size() - begin)));
    }
}

/// What a path knows of itself beside the ray it is on.
struct PathTracer::State {
    Rgb throughput = Rgb::Ones();
    float pdf = 0;             // of the ray's direction at the receiver it left; 0: a single one
    std::uint32_t path = 0;    // whose task and result
    std::uint32_t medium = 0;  // number in the wave's table
    std::int16_t depth = 0;    // vertices so far
    std::int16_t diffuse_bounces = 0;
    std::int16_t specular_bounces = 0;
    std::uint8_t views = kVirtualParts;  // scenes whose path this is
    Layer layer = Layer::Shadow;
    bool has_receiver = false;  // left a surface that photons are stored on: the one seen, or more
    /// Light met now is known from the photons of the last receiver.
    bool is_covered = false;
    bool is_layer_fixed = false;      // seen by way of a reflection or refraction
    bool is_from_first = false;       // left the surface seen by its diffuse lobe
    bool is_diffuse_segment = false;  // straight from a receiver's diffuse lobe
    bool is_soft = false;             // what comes now is soft light of the surface seen

    /// Goes on from a receiver by one of its lobes.
    void leave_receiver(Lobe lobe, float its_pdf, bool has_photons);
    /// Goes on from a mirror or a glass surface; the first of them makes the layer.
    void pass_specular(Layer seen_by, bool has_photons);
};

/// Share of the paths that go on from a receiver behind the one seen; the others are left to
/// chance.
inline float survival_of(const Rgb& throughput) { return std::min(1.0f, throughput.maxCoeff()); }

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
    float distance;  // up to which its way must be free
    std::uint32_t path;
    std::uint8_t path_views;
    std::uint8_t views;  // scenes, of those of the path, in which the light is there
    Layer layer;
    bool is_soft;
};

/// A path and the surface it met.
struct PathTracer::Meeting {
    State* state;
    const RayAndHit* ray;
};

/// Paths that go on side by side, one surface at a time: rays are sent one after the other, with
/// nothing in between that drives Embree's data out of the nearest caches.
struct PathTracer::Wave {
    explicit Wave(const RenderScene& scene) : media(scene) {}
    Wave(const RenderScene& scene, std::span<const PathTask> its_tasks,
         std::span<PathPair> its_results)
        : tasks(its_tasks), results(its_results), media(scene) {}

    std::span<const PathTask> tasks;
    std::span<PathPair> results;
    MediumTable media;
    std::vector<RayAndHit> rays;  // under way, then answered
    std::vector<State> states;    // of `rays`
    std::vector<RayAndHit> next_rays;
    std::vector<State> next;  // of `next_rays`
    // Met in the scene without virtual parts alone, by paths that were those of both.
    std::vector<State> parted;
    std::vector<RayAndHit> parted_rays;
    // Surfaces that wait, met by the states above, in the order in which they came.
    std::vector<Meeting> plain, glass;
    PlainLanes lanes = {};
    GlassLanes bent = {};
    std::vector<BareRay> shadow_rays;
    std::vector<ShadowRay> shadows;  // of `shadow_rays`
    std::vector<int> shadow_lanes;   // of the last shadow rays

    const PathTask& task(const State& state) const { return tasks[state.path]; }
    Sink sink(const State& state) const { return {results[state.path]}; }
    /// The path's random numbers at its vertex, into a lane.
    void set_random(int i, const State& state);
    /// Surfaces met point into what was parted: room for all of them.
    void reserve_parted(std::size_t count);
    /// The next rays become those under way.
    void go_on();
    /// A path that goes on.
    State& add(const State& state, const Vec3f& origin, const Vec3f& direction);
    /// Light along a way up to a hair before `distance`.
    void add_shadow(const State& state, std::uint32_t views, Layer layer, const Rgb& light,
                    const Vec3f& origin, const Vec3f& direction, float distance);
    /// Puts the shadow rays from `first` on, of `shadow_lanes`, in the order of their lanes.
    void sort_shadows(std::size_t first, int lane_count);
};

/// What rays of a path meet that belongs to the scenes `views`, see PathTracer::entering.
inline std::uint32_t mask_of(std::uint32_t views) {
    return views & kVirtualParts ? kAllParts : kRealParts;
}

inline void PathTracer::State::leave_receiver(Lobe lobe, float its_pdf, bool has_photons) {
    const bool was_seen = !has_receiver;
    if (lobe == Lobe::Glossy && was_seen && !is_layer_fixed) {
        layer = Layer::Reflection;
        is_layer_fixed = true;
    }
    // A glossy bounce on the way to an earlier receiver goes on with that receiver's photons.
    is_covered = lobe == Lobe::Glossy && !was_seen && has_photons;
    pdf = is_covered ? 0.0f : its_pdf;
    is_diffuse_segment = lobe == Lobe::Diffuse;
    is_from_first = was_seen && lobe == Lobe::Diffuse;
    has_receiver = true;
    ++diffuse_bounces;
}

inline void PathTracer::State::pass_specular(Layer seen_by, bool has_photons) {
    pdf = 0;
    is_diffuse_segment = false;
    is_covered |= has_receiver && has_photons;
    if (is_layer_fixed || has_receiver) return;
    layer = seen_by;
    is_layer_fixed = true;
}

inline void PathTracer::Wave::set_random(int i, const State& state) {
    const PathSampler& sampler = task(state).sample.sampler;
    lanes.random.stream[lane(i)] = sampler.mixed_stream();
    lanes.random.index[lane(i)] = sampler.index();
    lanes.random.depth[lane(i)] = static_cast<std::uint32_t>(state.depth);
}

inline void PathTracer::Wave::reserve_parted(std::size_t count) {
    parted.clear();
    parted_rays.clear();
    parted.reserve(count);
    parted_rays.reserve(count);
}

inline void PathTracer::Wave::go_on() {
    states.swap(next);
    rays.swap(next_rays);
    next.clear();
    next_rays.clear();
}

inline PathTracer::State& PathTracer::Wave::add(const State& state, const Vec3f& origin,
                                                const Vec3f& direction) {
    next_rays.emplace_back(origin, direction, mask_of(state.views));
    return next.emplace_back(state);
}

inline void PathTracer::Wave::add_shadow(const State& state, std::uint32_t views, Layer layer,
                                         const Rgb& light, const Vec3f& origin,
                                         const Vec3f& direction, float distance) {
    const float end = distance * (1 - 1e-4f);
    shadow_rays.emplace_back(origin, direction, end, mask_of(views));
    shadows.push_back({light, end, state.path, state.views, static_cast<std::uint8_t>(views), layer,
                       state.is_soft});
}

}  // namespace vitrine
