#include "render/path_tracer.h"

#include "render/interface.h"
#include "render/path_state.h"

namespace vitrine {

PathTracer::PathTracer(const RenderScene& scene, const CausticMaps* caustics, PathOptions options,
                       const TranslucentLight* translucent)
    : scene_(scene),
      caustics_(caustics),
      options_(options),
      translucent_(translucent),
      has_virtual_(scene.has_virtual()),
      has_lamps_(!scene.lights().lamps().empty()),
      has_background_(!scene.lights().environments().empty() ||
                      (scene.lights().ambient() != 0).any()),
      lane_lights_(lane_lights(scene.lights())) {}

PathResult PathTracer::trace(const Vec3f& origin, const PathTask& task) const {
    PathPair pair;
    Wave wave(scene_, std::span(&task, 1), std::span(&pair, 1));
    start(origin, kVirtualParts, wave);
    return pair.with_;
}

PathPair PathTracer::trace_both(const Vec3f& origin, const PathTask& task) const {
    PathPair pair;
    Workspace workspace(*this);
    trace_both(origin, std::span(&task, 1), std::span(&pair, 1), workspace);
    return pair;
}

PathTracer::Workspace::Workspace(const PathTracer& tracer)
    : wave_(std::make_unique<Wave>(tracer.scene_)) {}
PathTracer::Workspace::~Workspace() = default;

void PathTracer::trace_both(const Vec3f& origin, std::span<const PathTask> tasks,
                            std::span<PathPair> results, Workspace& workspace) const {
    Wave& wave = *workspace.wave_;
    wave.tasks = tasks;
    wave.results = results;
    start(origin, has_virtual_ ? kAllParts : kVirtualParts, wave);
}

void PathTracer::start(const Vec3f& origin, std::uint32_t views, Wave& wave) const {
    const std::size_t count = wave.tasks.size();
    wave.rays.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        wave.results[i].clear();
        wave.rays.emplace_back(origin, wave.tasks[i].sample.direction, mask_of(views));
    }
    // Neighbours' camera rays run side by side, which Embree's packets are made for.
    scene_.closest(wave.rays, true);
    State first;
    first.views = static_cast<std::uint8_t>(views);
    prefetch(wave);
    wave.states.reserve(count);  // surfaces met point into it
    wave.reserve_parted(has_virtual_ ? count : 0);
    for (std::size_t i = 0; i < count; ++i) {
        if (!wave.rays[i].is_hit() && !has_lamps_ && !has_background_) continue;
        State& state = wave.states.emplace_back(first);
        state.path = static_cast<std::uint32_t>(i);
        meet(state, wave.rays[i], wave);
    }
    finish(wave);
}

void PathTracer::finish(Wave& wave) const {
    for (;;) {
        shade_plain(wave);
        pass_glass(wave);
        add_shadows(wave);
        wave.go_on();
        const std::size_t count = wave.states.size();
        if (count == 0) return;
        scene_.closest(wave.rays, false);
        prefetch(wave);
        wave.reserve_parted(has_virtual_ ? count : 0);
        for (std::size_t i = 0; i < count; ++i) meet(wave.states[i], wave.rays[i], wave);
    }
}

void PathTracer::prefetch(const Wave& wave) const {
    for (const RayAndHit& ray : wave.rays) scene_.prefetch_triangle(ray);
    for (const RayAndHit& ray : wave.rays) scene_.prefetch_vertices(ray);
}

void PathTracer::meet(State& state, const RayAndHit& ray, Wave& wave) const {
    if (state.views != kAllParts || !ray.is_hit() || !scene_.is_virtual(ray.part)) {
        step(state, ray, wave);
        return;
    }
    wave.sink(state).part();
    State& real = wave.parted.emplace_back(state);
    real.views = kRealParts;
    state.views = kVirtualParts;
    step(state, ray, wave);
    RayAndHit& behind =
        wave.parted_rays.emplace_back(ray.ray.origin, ray.ray.direction, mask_of(real.views));
    scene_.closest(std::span(&behind, 1), false);
    step(real, behind, wave);
}

void PathTracer::entering(const ShadingPoint& point, float eta, std::span<const PathTask> tasks,
                          std::uint32_t views, std::span<PathPair> results) const {
    Wave wave(scene_, tasks, results);
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
    finish(wave);
}

void PathTracer::step(State& state, const RayAndHit& ray, Wave& wave) const {
    Sink sink = wave.sink(state);
    if (wave.media.absorbs(state.medium)) {
        state.throughput *= scene_.transmittance(wave.media.media(state.medium), ray.distance());
    }
    if (has_lamps_) add_emission(state, ray, sink);
    if (!ray.is_hit()) {
        if (has_background_) add_environment(state, ray, sink);
        return;
    }
    if (state.depth == 0) {
        sink.each(state.views, [&](PathResult& result) { result.first_part = ray.part; });
    }
    if (state.is_soft) {
        sink.each(state.views, [&](PathResult& result) {
            if (result.soft.hit_distance == 0) result.soft.hit_distance = ray.distance();
        });
    }
    ++state.depth;
    if (scene_.shape(ray.part).is_diffuse) {
        wave.plain.push_back({&state, &ray});
        return;
    }
    if (scene_.dielectric(ray.part)) {
        if (++state.specular_bounces <= options_.max_specular_bounces) {
            wave.glass.push_back({&state, &ray});
        }
        return;
    }
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
    const PathSampler& sampler = wave.task(state).sample.sampler;
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
