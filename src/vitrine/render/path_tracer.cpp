#include "render/path_tracer.h"

#include "render/interface.h"
#include "render/path_state.h"

namespace vitrine {
namespace {

/// A branch of a split ray fainter than this is left to chance.
constexpr float kMinSplitShare = 0.01f;

}  // namespace

PathTracer::PathTracer(const RenderScene& scene, const CausticMaps* caustics, PathOptions options,
                       const TranslucentLight* translucent)
    : scene_(scene),
      caustics_(caustics),
      options_(options),
      translucent_(translucent),
      has_virtual_(scene.has_virtual()),
      lane_lights_(lane_lights(scene.lights())) {}

PathResult PathTracer::trace(const Vec3f& origin, const PathTask& task) const {
    PathPair pair;
    Wave wave(std::span(&task, 1), std::span(&pair, 1));
    start(origin, kVirtualParts, wave);
    return pair.with_;
}

PathPair PathTracer::trace_both(const Vec3f& origin, const PathTask& task) const {
    PathPair pair;
    Workspace workspace;
    trace_both(origin, std::span(&task, 1), std::span(&pair, 1), workspace);
    return pair;
}

PathTracer::Workspace::Workspace() : wave_(std::make_unique<Wave>()) {}
PathTracer::Workspace::~Workspace() = default;

void PathTracer::trace_both(const Vec3f& origin, std::span<const PathTask> tasks,
                            std::span<PathPair> results, Workspace& workspace) const {
    Wave& wave = *workspace.wave_;
    wave.tasks = tasks;
    wave.results = results;
    start(origin, has_virtual_ ? kAllParts : kVirtualParts, wave);
}

void PathTracer::start(const Vec3f& origin, std::uint32_t views, Wave& wave) const {
    State first;
    first.origin = origin;
    first.views = views;
    const Ray ray{origin, Vec3f::Zero(), 0.0f, 1e30f, mask_of(views)};
    wave.states.assign(wave.tasks.size(), first);
    wave.rays.assign(wave.tasks.size(), ray);
    for (std::size_t i = 0; i < wave.tasks.size(); ++i) {
        wave.results[i].clear();
        wave.states[i].path = static_cast<std::uint32_t>(i);
        wave.states[i].direction = wave.rays[i].direction = wave.tasks[i].sample.direction;
    }
    // Neighbours' camera rays run side by side, which Embree's packets are made for.
    wave.hits.resize(wave.rays.size());
    scene_.closest(wave.rays, wave.hits);
    finish(wave);
}

void PathTracer::finish(Wave& wave) const {
    while (!wave.states.empty()) {
        wave.next.clear();
        const std::size_t count = wave.states.size();
        for (const Hit& hit : wave.hits) scene_.prefetch_triangle(hit);
        for (const Hit& hit : wave.hits) scene_.prefetch_vertices(hit);
        for (std::size_t i = 0; i < count; ++i) {
            State& state = wave.states[i];
            const Hit& hit = wave.hits[i];
            if (state.views == kAllParts && hit.is_hit() && scene_.is_virtual(hit.part)) {
                wave.sink(state).part();
                if (wave.parted.empty()) {  // hits of plain surfaces point into both
                    wave.parted.reserve(count);
                    wave.parted_hits.reserve(count);
                }
                State& real = wave.parted.emplace_back(state);
                real.views = kRealParts;
                state.views = kVirtualParts;
                step(state, hit, wave);
                step(real, wave.parted_hits.emplace_back(closest(real)), wave);
            } else {
                step(state, hit, wave);
            }
        }
        shade_plain(wave);
        wave.parted.clear();
        wave.parted_hits.clear();
        add_shadows(wave);
        wave.states.swap(wave.next);
        find_hits(wave);
    }
}

Hit PathTracer::closest(const State& state) const {
    return scene_.closest({state.origin, state.direction, 0.0f, 1e30f, mask_of(state.views)});
}

void PathTracer::find_hits(Wave& wave) const {
    wave.hits.resize(wave.states.size());
    for (std::size_t i = 0; i < wave.states.size(); ++i) wave.hits[i] = closest(wave.states[i]);
}

void PathTracer::entering(const ShadingPoint& point, float eta, std::span<const PathTask> tasks,
                          std::uint32_t views, std::span<PathPair> results) const {
    Wave wave(tasks, results);
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
        if (scatter(state, point, bsdf, frame, wo, tasks[i].sample.sampler)) {
            wave.states.push_back(state);
        }
    }
    add_shadows(wave);
    find_hits(wave);
    finish(wave);
}

void PathTracer::step(State& state, const Hit& hit, Wave& wave) const {
    Sink sink = wave.sink(state);
    const float distance = hit.is_hit() ? hit.distance : 1e30f;
    if (state.media.current() != Media::kNone) {
        state.throughput *= scene_.transmittance(state.media, distance);
    }
    add_emission(state, distance, sink);
    if (!hit.is_hit()) {
        add_environment(state, sink);
        return;
    }
    if (state.depth == 0) {
        sink.each(state.views, [&](PathResult& result) { result.first_part = hit.part; });
    }
    if (state.is_soft) {
        sink.each(state.views, [&](PathResult& result) {
            if (result.soft.hit_distance == 0) result.soft.hit_distance = hit.distance;
        });
    }
    ++state.depth;
    if (scene_.shape(hit.part).is_diffuse) {
        wave.plain.push_back({&state, &hit});
        return;
    }
    const ShadingPoint point = scene_.surface(hit, state.direction);
    if (scene_.dielectric(hit.part)) {
        if (++state.specular_bounces > options_.max_specular_bounces) return;
        pass_interface(state, point, wave);
        return;
    }
    const Bsdf bsdf = scene_.bsdf(point, hit);
    if (is_smooth(bsdf)) {
        if (++state.specular_bounces > options_.max_specular_bounces) return;
        state.throughput *= std::get<MirrorBsdf>(bsdf).reflectance;
        state.direction = mirror_direction(point, state.direction);
        state.origin = scene_.leave(point, state.direction);
        state.pdf = 0;
        state.is_diffuse_segment = false;
        state.is_covered |= state.has_receiver && caustics_;
        if (!state.is_layer_fixed && !state.has_receiver) {
            state.layer = Layer::Reflection;
            state.is_layer_fixed = true;
        }
        wave.next.push_back(state);
        return;
    }
    const PathSampler& sampler = wave.task(state).sample.sampler;
    const PathWish& wish = wave.task(state).wish;
    const Frame frame(point.shading_normal);
    Vec3f wo = frame.to_local(-state.direction);
    // The rounded surface may face away where the facet does not: keep to the horizon.
    if (wo.z() <= 0) wo = Vec3f(wo.x(), wo.y(), 1e-4f).normalized();
    if (!state.is_layer_fixed) {
        state.layer = state.is_first_receiver ? Layer::Shadow : Layer::Diffuse;
    }
    add_exitance(state, point, bsdf, wo, sink);
    add_direct(state, point, bsdf, frame, wo, state.has_receiver ? 1 : wish.light_samples, wave);
    add_caustics(state, point, bsdf, frame, wo, sink);
    if (options_.direct_light_only || state.diffuse_bounces >= options_.max_diffuse_bounces) {
        return;
    }
    add_secondary(state, point, bsdf, wave);
    if (scatter(state, point, bsdf, frame, wo, sampler)) wave.next.push_back(state);
}

bool PathTracer::scatter(State& state, const ShadingPoint& point, const Bsdf& bsdf,
                         const Frame& frame, const Vec3f& wo, const PathSampler& sampler) const {
    const bool has_choice = !std::holds_alternative<DiffuseBsdf>(bsdf);
    const BsdfSample s = sample(bsdf, wo, sampler.pair(state.depth, kScatterUse),
                                has_choice ? sampler.number(state.depth, kLobeUse) : 0.0f);
    if (!(s.weight > 0).any()) return false;
    const Vec3f direction = frame.to_world(s.wi);
    if (direction.dot(point.geometric_normal) <= 0) return false;
    state.throughput *= s.weight;
    return send_on(state, s, direction, scene_.leave_smooth(point), sampler);
}

bool PathTracer::send_on(State& state, const BsdfSample& s, const Vec3f& direction,
                         const Vec3f& origin, const PathSampler& sampler) const {
    const bool was_seen = !state.has_receiver;
    if (s.lobe == Lobe::Glossy && was_seen && !state.is_layer_fixed) {
        state.layer = Layer::Reflection;
        state.is_layer_fixed = true;
    }
    // A glossy bounce on the way to an earlier receiver goes on with that receiver's photons.
    const bool goes_on_covered = s.lobe == Lobe::Glossy && !was_seen && caustics_;
    state.is_covered = goes_on_covered;
    state.pdf = goes_on_covered ? 0.0f : s.pdf;
    state.is_diffuse_segment = s.lobe == Lobe::Diffuse;
    state.is_from_first = was_seen && s.lobe == Lobe::Diffuse;
    state.has_receiver = true;
    state.is_first_receiver = false;
    state.direction = direction;
    state.origin = state.receiver = origin;
    ++state.diffuse_bounces;
    if (state.diffuse_bounces > 1) {
        const float survival = std::min(1.0f, state.throughput.maxCoeff());
        if (sampler.number(state.depth, kRouletteUse) >= survival) return false;
        state.throughput /= survival;
    }
    return true;
}

void PathTracer::pass_interface(const State& state, const ShadingPoint& point, Wave& wave) const {
    const InterfaceEvent event = cross_interface(scene_, point, state.direction, state.media);
    State reflected = state, refracted = state;
    refracted.direction = event.refracted;
    refracted.media = event.beyond;
    refracted.origin = scene_.leave(point, refracted.direction);
    if (!event.is_optical) {
        wave.next.push_back(refracted);
        return;
    }
    reflected.direction = event.reflected;
    reflected.origin = scene_.leave(point, reflected.direction);
    for (State* branch : {&reflected, &refracted}) {
        branch->pdf = 0;
        branch->is_diffuse_segment = false;
        branch->is_covered |= state.has_receiver && caustics_;
        if (!state.is_layer_fixed && !state.has_receiver) {
            branch->layer = branch == &reflected ? Layer::Reflection : Layer::Refraction;
            branch->is_layer_fixed = true;
        }
    }
    // Radiance is compressed into a smaller solid angle in the denser medium (Veach 1997, 5.2).
    const float compression = 1.0f / (event.eta * event.eta);
    const float f = event.reflectance;
    if (f >= 1) {
        wave.next.push_back(reflected);
        return;
    }
    const float faint_share = std::min(f, 1 - f) * state.throughput.maxCoeff();
    if (!state.has_receiver && state.specular_bounces <= options_.split_depth &&
        faint_share > kMinSplitShare) {
        reflected.throughput *= f;
        refracted.throughput *= (1 - f) * compression;
        wave.next.push_back(refracted);
        wave.next.push_back(reflected);
        return;
    }
    if (wave.task(state).sample.sampler.number(state.depth, kBranchUse) < f) {
        wave.next.push_back(reflected);
    } else {
        refracted.throughput *= compression;
        wave.next.push_back(refracted);
    }
}

}  // namespace vitrine
