#include "render/path_tracer.h"

#include "base/error.h"
#include "render/interface.h"
#include "render/path_state.h"

namespace vitrine {
namespace {

/// Whether the place on some light is chosen anew for every shadow ray.
bool has_places(const LightSampler& lights) {
    for (std::size_t i = 0; i < lights.count(); ++i) {
        if (lights.needs_position(i)) return true;
    }
    return false;
}

}  // namespace

PathTracer::PathTracer(const RenderScene& scene, const CausticMaps* caustics, PathOptions options,
                       const TranslucentLight* translucent)
    : scene_(scene),
      caustics_(caustics),
      options_(options),
      translucent_(translucent),
      has_virtual_(scene.has_virtual()),
      has_lamps_(!scene.lights().lamps().empty()),
      varies_light_(scene.lights().count() > 1 || has_places(scene.lights())),
      has_background_(!scene.lights().environments().empty() ||
                      (scene.lights().ambient() != 0).any()),
      lane_lights_(lane_lights(scene.lights())) {}

PathResult PathTracer::trace(const Vec3f& origin, const Vec3f& direction,
                             const PathTask& task) const {
    return trace_one(origin, direction, task, kVirtualParts).with_;
}

PathPair PathTracer::trace_both(const Vec3f& origin, const Vec3f& direction,
                                const PathTask& task) const {
    return trace_one(origin, direction, task, all_views());
}

PathPair PathTracer::trace_one(const Vec3f& origin, const Vec3f& direction, const PathTask& task,
                               std::uint32_t views) const {
    PathPair pair;
    Wave wave(scene_, std::span(&task, 1), std::span(&pair, 1));
    wave.flights.make_room(1);
    wave.flights.add(origin, direction, kAllParts, State());
    start(views, wave);
    return pair;
}

PathTracer::Workspace::Workspace(const PathTracer& tracer)
    : wave_(std::make_unique<Wave>(tracer.scene_)) {}
PathTracer::Workspace::~Workspace() = default;
RayList PathTracer::Workspace::start(std::size_t count) {
    wave_->flights.clear();
    wave_->flights.make_room(count);
    wave_->flights.take(wave_->flights.begin() + count);
    return RayList::of(wave_->flights.items());
}

void PathTracer::trace_both(std::span<const PathTask> tasks, std::span<PathPair> results,
                            Workspace& workspace) const {
    Wave& wave = *workspace.wave_;
    wave.tasks = tasks;
    wave.results = results;
    start(all_views(), wave);
}

void PathTracer::start(std::uint32_t views, Wave& wave) const {
    VITRINE_CHECK_EQ(wave.flights.size(), wave.tasks.size());
    State first;
    first.views = static_cast<std::uint8_t>(views);
    for (Flight& flight : wave.flights) {
        flight.state = first;
        ++first.path;
    }
    for (PathPair& result : wave.results) result.clear();
    // Neighbours' camera rays run side by side, which Embree's packets are made for.
    finish(wave, true);
}

void PathTracer::finish(Wave& wave, bool are_alike) const {
    for (; wave.flights.size() > 0; are_alike = false) {
        scene_.closest(RayList::of(wave.flights.items()), are_alike);
        prefetch(wave);
        wave.make_room(wave.flights.size(), has_virtual_);
        for (Flight& flight : wave.flights) {
            if (flight.ray.is_hit() || has_lamps_ || has_background_) meet(flight, wave);
        }
        by_lanes(wave.plain.items(), [&](std::span<Flight*> hits) { shade_plain(wave, hits); });
        by_lanes(wave.glass.items(), [&](std::span<Flight*> hits) { pass_glass(wave, hits); });
        add_shadows(wave);
        wave.go_on();
    }
}

void PathTracer::prefetch(const Wave& wave) const {
    if (!scene_.is_large()) return;
    for (const Flight& flight : wave.flights) scene_.prefetch_triangle(flight.ray);
    for (const Flight& flight : wave.flights) scene_.prefetch_vertices(flight.ray);
}

void PathTracer::meet(Flight& flight, Wave& wave) const {
    const auto& [ray, state] = flight;
    if (state.views == kAllParts && ray.is_hit() && scene_.is_virtual(ray.part)) {
        part(flight, wave);
    } else {
        step(flight, wave);
    }
}

void PathTracer::part(Flight& flight, Wave& wave) const {
    const auto& [ray, state] = flight;
    wave.sink(state).part();
    Flight& behind = wave.parted.add(ray.ray.origin, ray.ray.direction, mask_of(kRealParts), state);
    behind.state.views = kRealParts;
    flight.state.views = kVirtualParts;
    step(flight, wave);
    scene_.closest(std::span(&behind.ray, 1), false);
    step(behind, wave);
}

void PathTracer::entering(const ShadingPoint& point, float eta, std::span<const PathTask> tasks,
                          std::uint32_t views, std::span<PathPair> results) const {
    Wave wave(scene_, tasks, results);
    wave.make_room(tasks.size(), has_virtual_);
    const bool is_in_one = views == kVirtualParts || views == kRealParts;
    const Bsdf bsdf = EnteringBsdf{eta};
    const Frame frame(point.shading_normal);
    const Vec3f wo(0, 0, 1);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
        results[i].clear();
        results[i].is_touched_ = is_in_one;
        if (views == 0) continue;
        State state;
        state.path = static_cast<std::uint32_t>(i);
        state.depth = 1;
        state.views = views == kAllParts && !has_virtual_ ? kVirtualParts : views;
        add_direct(state, point, bsdf, frame, wo, 1, wave);
        if (options_.direct_light_only) continue;
        add_secondary(state, point, bsdf, wave);
        scatter(state, point, bsdf, frame, wo, wave);
    }
    add_shadows(wave);
    wave.go_on();
    finish(wave, false);
}

// Once per ray that meets something: within the loop of `finish`.
inline void PathTracer::step(Flight& flight, Wave& wave) const {
    auto& [ray, state] = flight;
    Sink sink = wave.sink(state);
    if (state.medium != 0 && wave.media.absorbs(state.medium)) {
        state.throughput *= scene_.transmittance(wave.media.media(state.medium), ray.distance());
    }
    if (has_lamps_) add_emission(state, ray, sink);
    if (!ray.is_hit()) {
        if (has_background_) add_environment(state, ray, sink);
        return;
    }
    if (has_virtual_ && state.depth == 0 && scene_.is_virtual(ray.part)) {
        sink.each(state.views, [&](PathResult& result) { result.set_sees_virtual(); });
    }
    if (state.is_soft) {
        sink.each(state.views, [&](PathResult& result) { result.meet_soft(ray.distance()); });
    }
    ++state.depth;
    const PartShape& shape = scene_.shape(ray.part);
    if (shape.is_diffuse) {
        wave.plain.add(&flight);
        return;
    }
    if (shape.is_dielectric) {
        if (++state.specular_bounces <= options_.max_specular_bounces) {
            wave.glass.add(&flight);
        }
        return;
    }
    scatter_alone(state, ray, wave);
}

void PathTracer::scatter_alone(State& state, const RayAndHit& ray, Wave& wave) const {
    Sink sink = wave.sink(state);
    const Hit hit = hit_of(ray);
    const ShadingPoint point = scene_.surface(hit, ray.ray.direction);
    const Bsdf bsdf = scene_.bsdf(point, hit);
    if (is_smooth(bsdf)) {
        if (++state.specular_bounces > options_.max_specular_bounces) return;
        pass_mirror(state, point, ray, std::get<MirrorBsdf>(bsdf).reflectance, wave);
        return;
    }
    const PathWish& wish = wave.task(state).wish;
    const Frame frame(point.shading_normal);
    Vec3f wo = frame.to_local(-ray.ray.direction);
    // The rounded surface may face away where the facet does not: keep to the horizon.
    if (wo.z() <= 0) wo = Vec3f(wo.x(), wo.y(), 1e-4f).normalized();
    if (!state.is_layer_fixed) state.layer = state.has_receiver ? Layer::Diffuse : Layer::Shadow;
    add_exitance(state, point, bsdf, wo, sink);
    add_direct(state, point, bsdf, frame, wo, state.has_receiver ? 1 : wish.light_samples, wave);
    add_caustics(state, point, ray.ray.origin, bsdf, frame, wo, sink);
    if (options_.direct_light_only || state.diffuse_bounces >= options_.max_diffuse_bounces) {
        return;
    }
    add_secondary(state, point, bsdf, wave);
    scatter(state, point, bsdf, frame, wo, wave);
}

void PathTracer::scatter(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                         const Frame& frame, const Vec3f& wo, Wave& wave) const {
    const PathSampler& sampler = wave.task(state).sampler;
    const bool has_choice = !std::holds_alternative<DiffuseBsdf>(bsdf);
    const BsdfSample s = sample(bsdf, wo, sampler.pair(state.depth, kScatterUse),
                                has_choice ? sampler.number(state.depth, kLobeUse) : 0.0f);
    if (!(s.weight > 0).any()) return;
    const Vec3f direction = frame.to_world(s.wi);
    if (direction.dot(point.geometric_normal) <= 0) return;
    Rgb throughput = state.throughput * s.weight;
    if (state.has_receiver) {
        const float survival = survival_of(throughput);
        if (sampler.number(state.depth, kRouletteUse) >= survival) return;
        throughput /= survival;
    }
    State& next = wave.add(state, scene_.leave_smooth(point), direction);
    next.throughput = throughput;
    next.leave_receiver(s.lobe, s.pdf, caustics_ != nullptr);
}

void PathTracer::pass_mirror(const State& state, const ShadingPoint& point, const RayAndHit& ray,
                             const Rgb& reflectance, Wave& wave) const {
    const Vec3f direction = mirror_direction(point, ray.ray.direction);
    State& next = wave.add(state, scene_.leave(point, direction), direction);
    next.throughput *= reflectance;
    next.pass_specular(Layer::Reflection, caustics_ != nullptr);
}

}  // namespace vitrine
