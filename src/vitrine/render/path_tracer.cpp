#include "render/path_tracer.h"

#include "render/interface.h"
#include "render/path_state.h"
#include "render/small_stack.h"

namespace vitrine {
namespace {

/// A branch of a split ray fainter than this is left to chance.
constexpr float kMinSplitShare = 0.01f;

/// Branches that may wait; one place is kept for the path of the scene without virtual parts.
constexpr int kMaxPending = 32;

}  // namespace

struct PathTracer::Pending : SmallStack<State, kMaxPending + 1> {};

PathTracer::PathTracer(const RenderScene& scene, const CausticMaps* caustics, PathOptions options,
                       const TranslucentLight* translucent)
    : scene_(scene),
      caustics_(caustics),
      options_(options),
      translucent_(translucent),
      has_virtual_(scene.has_virtual()) {}

PathResult PathTracer::trace(const Vec3f& origin, const Vec3f& direction,
                             const PathSampler& sampler, const PathWish& wish) const {
    PathResult result;
    Sink sink{result, result};
    State first;
    first.origin = origin;
    first.direction = direction;
    finish(first, sampler, wish, sink);
    return result;
}

PathPair PathTracer::trace_both(const Vec3f& origin, const Vec3f& direction,
                                const PathSampler& sampler, const PathWish& wish) const {
    PathPair pair;
    Sink sink{pair.with_, pair.without_};
    State first;
    first.origin = origin;
    first.direction = direction;
    first.views = has_virtual_ ? kAllParts : kVirtualParts;
    finish(first, sampler, wish, sink);
    pair.is_touched_ = sink.is_touched;
    return pair;
}

void PathTracer::finish(const State& first, const PathSampler& sampler, const PathWish& wish,
                        Sink& sink) const {
    Pending pending;
    follow(first, pending, sampler, wish, sink);
    while (!pending.empty()) follow(pending.pop(), pending, sampler, wish, sink);
}

PathPair PathTracer::entering(const ShadingPoint& point, float eta, const PathSampler& sampler,
                              std::uint32_t views) const {
    PathPair pair;
    const bool is_in_one = views == kVirtualParts || views == kRealParts;
    Sink sink{pair.with_, pair.without_, is_in_one};
    State state;
    state.depth = 1;
    state.is_fresh = false;
    state.views = views == kAllParts && !has_virtual_ ? kVirtualParts : views;
    const Bsdf bsdf = EnteringBsdf{eta};
    const Frame frame(point.shading_normal);
    const Vec3f wo(0, 0, 1);
    if (views != 0) {
        add_direct(state, point, bsdf, frame, wo, sampler, 1, sink);
        if (!options_.direct_light_only) {
            add_secondary(state, point, bsdf, sampler, sink);
            if (scatter(state, point, bsdf, frame, wo, sampler)) {
                finish(state, sampler, {}, sink);
            }
        }
    }
    pair.is_touched_ = sink.is_touched;
    return pair;
}

void PathTracer::follow(State state, Pending& pending, const PathSampler& sampler,
                        const PathWish& wish, Sink& sink) const {
    while (true) {
        const Hit hit = wish.first && state.is_fresh
                            ? *wish.first
                            : scene_.closest({state.origin, state.direction, 0.0f, 1e30f,
                                              mask_of(state.views)});
        state.is_fresh = false;
        if (state.views == kAllParts && hit.is_hit() && scene_.is_virtual(hit.part)) {
            sink.part();
            state.views = kRealParts;
            pending.push(state);
            state.views = kVirtualParts;
        }
        state.throughput *= scene_.transmittance(state.media, hit.is_hit() ? hit.distance : 1e30f);
        add_emission(state, hit.is_hit() ? hit.distance : 1e30f, sink);
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
        const ShadingPoint point = scene_.surface(hit, state.direction);
        ++state.depth;
        if (scene_.dielectric(hit.part)) {
            if (++state.specular_bounces > options_.max_specular_bounces) return;
            if (!pass_interface(state, point, pending, sampler)) return;
            continue;
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
            continue;
        }
        const Frame frame(point.shading_normal);
        Vec3f wo = frame.to_local(-state.direction);
        // The rounded surface may face away where the facet does not: keep to the horizon.
        if (wo.z() <= 0) wo = Vec3f(wo.x(), wo.y(), 1e-4f).normalized();
        if (!state.is_layer_fixed) {
            state.layer = state.is_first_receiver ? Layer::Shadow : Layer::Diffuse;
        }
        add_exitance(state, point, bsdf, wo, sink);
        add_direct(state, point, bsdf, frame, wo, sampler,
                   state.has_receiver ? 1 : wish.light_samples, sink);
        add_caustics(state, point, bsdf, frame, wo, sink);
        if (options_.direct_light_only || state.diffuse_bounces >= options_.max_diffuse_bounces) {
            return;
        }
        const auto* plain = std::get_if<DiffuseBsdf>(&bsdf);
        if (plain && !state.has_receiver && !state.is_layer_fixed) {
            sink.each(state.views, [&](PathResult& result) {
                result.soft.is_present = true;
                result.soft.albedo = plain->albedo;
                result.soft.position = point.position;
                result.soft.normal = point.shading_normal;
            });
            if (!wish.finds_soft) return;
            state.is_soft = true;
        }
        add_secondary(state, point, bsdf, sampler, sink);
        if (!scatter(state, point, bsdf, frame, wo, sampler)) return;
    }
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
    state.origin = scene_.leave_smooth(point);
    state.receiver = state.origin;
    ++state.diffuse_bounces;
    if (state.diffuse_bounces > 1) {
        const float survival = std::min(1.0f, state.throughput.maxCoeff());
        if (sampler.number(state.depth, kRouletteUse) >= survival) return false;
        state.throughput /= survival;
    }
    return true;
}

bool PathTracer::pass_interface(State& state, const ShadingPoint& point, Pending& pending,
                                const PathSampler& sampler) const {
    const InterfaceEvent event = cross_interface(scene_, point, state.direction, state.media);
    State reflected = state, refracted = state;
    refracted.direction = event.refracted;
    refracted.media = event.beyond;
    refracted.origin = scene_.leave(point, refracted.direction);
    if (!event.is_optical) {
        state = refracted;
        return true;
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
        state = reflected;
        return true;
    }
    const float faint_share = std::min(f, 1 - f) * state.throughput.maxCoeff();
    if (!state.has_receiver && state.specular_bounces <= options_.split_depth &&
        faint_share > kMinSplitShare && pending.size() < kMaxPending) {
        reflected.throughput *= f;
        refracted.throughput *= (1 - f) * compression;
        pending.push(reflected);
        state = refracted;
        return true;
    }
    if (sampler.number(state.depth, kBranchUse) < f) {
        state = reflected;
    } else {
        state = refracted;
        state.throughput *= compression;
    }
    return true;
}

}  // namespace vitrine
