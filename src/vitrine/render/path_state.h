// render/path_state.h: paths under way, and where their contributions go. For the files of
// `PathTracer` alone.
#pragma once

#include "render/batch.h"
#include "render/glass_lanes.h"
#include "render/medium_table.h"
#include "render/path_tracer.h"
#include "render/plain_lanes.h"

#include <cstring>
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

/// What a path knows of itself beside the ray it is on.
struct PathTracer::State {
    State() = default;
    // As a whole, which is a few wide moves; member by member it is twenty narrow ones.
    State(const State& other) { std::memcpy(static_cast<void*>(this), &other, sizeof(State)); }
    State& operator=(const State& other) {
        std::memcpy(static_cast<void*>(this), &other, sizeof(State));
        return *this;
    }

    Rgb throughput = Rgb::Ones();
    float pdf = 0;             // of the ray's direction at the receiver it left; 0: a single one
    std::uint32_t path = 0;    // whose task and result
    std::uint32_t medium = 0;  // number in the wave's table
    std::int16_t depth = 0;    // vertices so far
    std::int16_t diffuse_bounces = 0;
    std::int16_t specular_bounces = 0;
    std::uint8_t views = kVirtualParts;  // scenes whose path this is
    Layer layer = Layer::Shadow;
    // Left a surface that photons are stored on: the one seen, or more.
    bool has_receiver : 1 = false;
    // Light met now is known from the photons of the last receiver.
    bool is_covered : 1 = false;
    bool is_layer_fixed : 1 = false;      // seen by way of a reflection or refraction
    bool is_from_first : 1 = false;       // left the surface seen by its diffuse lobe
    bool is_diffuse_segment : 1 = false;  // straight from a receiver's diffuse lobe
    bool is_soft : 1 = false;             // what comes now is soft light of the surface seen

    /// Goes on from a receiver by one of its lobes.
    void leave_receiver(Lobe lobe, float its_pdf, bool has_photons);
    /// Goes on from a mirror or a glass surface; the first of them makes the layer.
    void pass_specular(Layer seen_by, bool has_photons);
};

/// How far the way to a light at a distance must be free.
inline float short_of(float distance) { return distance * (1 - 1e-4f); }

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
            if (is_soft) {
                result.add_soft(layer, radiance);
            } else {
                result.add(layer, radiance);
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
    ShadowRay() = default;
    /// @param its_views scenes, of those of the path, in which the light is there
    ShadowRay(const Rgb& its_light, float its_distance, const State& state, std::uint32_t its_views,
              Layer its_layer)
        : light(its_light),
          distance(its_distance),
          path(state.path),
          path_views(state.views),
          views(static_cast<std::uint8_t>(its_views)),
          layer(its_layer),
          is_soft(state.is_soft) {}
    Rgb light;
    float distance;  // up to which its way must be free
    std::uint32_t path;
    std::uint8_t path_views;
    std::uint8_t views;  // scenes, of those of the path, in which the light is there
    Layer layer;
    bool is_soft;
};

/// A path under way: its ray, then answered, and the rest.
struct alignas(64) PathTracer::Flight {
    Flight() = default;
    Flight(const Vec3f& origin, const Vec3f& direction, std::uint32_t mask, const State& its_state)
        : ray(origin, direction, mask), state(its_state) {}
    RayAndHit ray;
    State state;
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
    Batch<Flight> flights, next;
    // Met in the scene without virtual parts alone, by paths that were those of both.
    Batch<Flight> parted;
    // At surfaces that wait, in the order in which they came.
    Batch<Flight*> plain, glass;
    PlainLanes lanes = {};
    GlassLanes bent = {};
    Batch<BareRay> shadow_rays;
    Batch<ShadowRay> shadows;       // of `shadow_rays`
    std::vector<int> shadow_lanes;  // of the last shadow rays

    const PathTask& task(const State& state) const { return tasks[state.path]; }
    Sink sink(const State& state) const { return {results[state.path]}; }
    /// The path's random numbers at its vertex, into a lane.
    void set_random(int i, const State& state);
    /// Forgets what was met. Room for all that `count` paths under way may meet and for where they
    /// may go on: surfaces met point into it.
    void make_room(std::size_t count, bool may_part);
    /// Room for more shadow rays.
    void make_shadow_room(std::size_t count);
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
    const PathSampler& sampler = task(state).sampler;
    lanes.random.stream[lane(i)] = sampler.mixed_stream();
    lanes.random.index[lane(i)] = sampler.index();
    lanes.random.depth[lane(i)] = static_cast<std::uint32_t>(state.depth);
}

inline void PathTracer::Wave::make_room(std::size_t count, bool may_part) {
    parted.clear();
    plain.clear();
    glass.clear();
    parted.make_room(may_part ? count : 0);
    const std::size_t most = may_part ? 2 * count : count;
    plain.make_room(most);
    glass.make_room(most);
    next.make_room(2 * most);  // both branches at glass
}

inline void PathTracer::Wave::make_shadow_room(std::size_t count) {
    shadows.make_room(count);
    shadow_rays.make_room(count);
}

inline void PathTracer::Wave::go_on() {
    flights.swap(next);
    next.clear();
}

inline PathTracer::State& PathTracer::Wave::add(const State& state, const Vec3f& origin,
                                                const Vec3f& direction) {
    return next.add(origin, direction, mask_of(state.views), state).state;
}

inline void PathTracer::Wave::add_shadow(const State& state, std::uint32_t views, Layer layer,
                                         const Rgb& light, const Vec3f& origin,
                                         const Vec3f& direction, float distance) {
    const float end = short_of(distance);
    shadow_rays.add(origin, direction, end, mask_of(views));
    shadows.add(light, end, state, views, layer);
}

}  // namespace vitrine
