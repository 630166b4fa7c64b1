#include "render/path_tracer.h"

#include "optics/fresnel.h"
#include "render/interface.h"
#include "render/small_stack.h"

namespace vitrine {
namespace {

// Uses of a vertex's random numbers.
constexpr int kBranchUse = 1;
constexpr int kScatterUse = 2;
constexpr int kLobeUse = 3;
constexpr int kPickUse = 4;
constexpr int kRouletteUse = 5;
constexpr int kSecondaryUse = 15;
constexpr int kLightUse = 6;  // and one more per light

/// A branch of a split ray fainter than this is left to chance.
constexpr float kMinSplitShare = 0.01f;

float balance(float a, float b) { return a + b > 0 ? a / (a + b) : 0.0f; }

}  // namespace

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
};

struct PathTracer::Pending : SmallStack<State, 32> {};

PathTracer::PathTracer(const RenderScene& scene, const CausticMaps* caustics, PathOptions options,
                       const TranslucentLight* translucent)
    : scene_(scene), caustics_(caustics), options_(options), translucent_(translucent) {}

PathResult PathTracer::trace(const Vec3f& origin, const Vec3f& direction,
                             const PathSampler& sampler, std::uint32_t view,
                             const PathWish& wish) const {
    PathResult result;
    Pending pending;
    State first;
    first.origin = origin;
    first.direction = direction;
    pending.push(first);
    finish(pending, sampler, view, wish, result);
    return result;
}

void PathTracer::finish(Pending& pending, const PathSampler& sampler, std::uint32_t view,
                        const PathWish& wish, PathResult& result) const {
    while (!pending.empty()) follow(pending.pop(), pending, sampler, view, wish, result);
}

void PathTracer::add(const State& state, Layer layer, const Rgb& radiance, PathResult& result) {
    if (!state.is_soft) {
        result.layers[static_cast<std::size_t>(layer)] += radiance;
    } else {
        (layer == Layer::Shadow ? result.soft.shadow : result.soft.diffuse) += radiance;
    }
}

PathResult PathTracer::entering(const ShadingPoint& point, float eta, const PathSampler& sampler,
                                std::uint32_t view) const {
    PathResult result;
    State state;
    state.depth = 1;
    const Bsdf bsdf = EnteringBsdf{eta};
    const Frame frame(point.shading_normal);
    const Vec3f wo(0, 0, 1);
    add_direct(state, point, bsdf, frame, wo, sampler, view, 1, result);
    if (options_.direct_light_only) return result;
    add_secondary(state, point, bsdf, sampler, view, result);
    if (scatter(state, point, bsdf, frame, wo, sampler)) {
        Pending pending;
        pending.push(state);
        finish(pending, sampler, view, {}, result);
    }
    return result;
}

void PathTracer::follow(State state, Pending& pending, const PathSampler& sampler,
                        std::uint32_t view, const PathWish& wish, PathResult& result) const {
    while (true) {
        const Ray ray{state.origin, state.direction, 0.0f, 1e30f, view};
        const Hit hit = scene_.closest(ray);
        state.throughput *= scene_.transmittance(state.media, hit.is_hit() ? hit.distance : 1e30f);
        add_emission(state, hit.is_hit() ? hit.distance : 1e30f, result);
        if (!hit.is_hit()) {
            add_environment(state, result);
            return;
        }
        result.is_touched |= scene_.is_virtual(hit.part);
        if (state.depth == 0) result.first_part = hit.part;
        if (state.is_soft && result.soft.hit_distance == 0) result.soft.hit_distance = hit.distance;
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
        add_exitance(state, point, bsdf, wo, view, result);
        add_direct(state, point, bsdf, frame, wo, sampler, view,
                   state.has_receiver ? 1 : wish.light_samples, result);
        add_caustics(state, point, bsdf, frame, wo, view, result);
        if (options_.direct_light_only || state.diffuse_bounces >= options_.max_diffuse_bounces) {
            return;
        }
        const auto* plain = std::get_if<DiffuseBsdf>(&bsdf);
        if (plain && !state.has_receiver && !state.is_layer_fixed) {
            result.soft.is_present = true;
            result.soft.albedo = plain->albedo;
            result.soft.position = point.position;
            result.soft.normal = point.shading_normal;
            if (!wish.finds_soft) return;
            state.is_soft = true;
        }
        add_secondary(state, point, bsdf, sampler, view, result);
        if (!scatter(state, point, bsdf, frame, wo, sampler)) return;
    }
}

void PathTracer::add_emission(const State& state, float distance, PathResult& result) const {
    if (state.is_covered) return;
    const LightSampler& lights = scene_.lights();
    for (std::size_t i = 0; i < lights.count(); ++i) {
        if (!lights.can_be_hit(i)) continue;
        const auto hit = lights.hit(i, state.origin, state.direction, distance);
        if (!hit) continue;
        float weight = 1.0f;
        if (state.pdf > 0) {
            weight =
                balance(state.pdf, lights.pdf(i, state.receiver, state.direction, hit->distance));
        }
        add(state, state.layer, state.throughput * hit->radiance * weight, result);
    }
}

void PathTracer::add_environment(const State& state, PathResult& result) const {
    const LightSampler& lights = scene_.lights();
    Rgb radiance =
        options_.direct_light_only && state.has_receiver ? Rgb(Rgb::Zero()) : lights.ambient();
    if (!state.is_covered) {
        for (const std::size_t i : lights.environments()) {
            float weight = 1.0f;
            if (state.pdf > 0) {
                weight = balance(state.pdf, lights.pdf(i, state.receiver, state.direction, 1e30f));
            }
            radiance += lights.environment_radiance(i, state.direction) * weight;
        }
    }
    // An environment seen from the first surface is direct light, whatever its layer says by now.
    const Layer layer = state.is_from_first && !state.is_layer_fixed ? Layer::Shadow : state.layer;
    add(state, layer, state.throughput * radiance, result);
}

bool PathTracer::is_hidden(const Ray& ray, std::uint32_t view, PathResult& result) const {
    if (!scene_.is_occluded(ray)) return false;
    if (view == kAllParts && !result.is_touched) {
        Ray real = ray;
        real.mask = kRealParts;
        result.is_touched = !scene_.is_occluded(real);
    }
    return true;
}

void PathTracer::add_direct(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                            const Frame& frame, const Vec3f& wo, const PathSampler& sampler,
                            std::uint32_t view, int light_samples, PathResult& result) const {
    const LightSampler& lights = scene_.lights();
    if (lights.count() == 0) return;
    // All lights at the surface seen; one of them, by turns of chance, at those behind it.
    const bool takes_all = state.is_first_receiver || lights.count() == 1;
    std::size_t begin = 0, end = lights.count();
    float boost = 1.0f;
    if (!takes_all) {
        const float u = sampler.number(state.depth, kPickUse);
        begin = std::min(lights.count() - 1,
                         static_cast<std::size_t>(u * static_cast<float>(lights.count())));
        end = begin + 1;
        boost = static_cast<float>(lights.count());
    }
    const Vec3f origin = scene_.leave_smooth(point);
    for (std::size_t i = begin; i < end; ++i) {
        const int use = kLightUse + static_cast<int>(takes_all ? std::min<std::size_t>(i, 8) : 0);
        const int count = lights.needs_position(i) ? light_samples : 1;
        for (int k = 0; k < count; ++k) {
            Vec2f u(0.5f, 0.5f);
            if (lights.needs_position(i)) u = sampler.pair(state.depth, use, count, k);
            const auto s = lights.sample(i, origin, u);
            if (!s) continue;
            const Vec3f wi = frame.to_local(s->direction);
            if (wi.z() <= 0 || s->direction.dot(point.geometric_normal) <= 0) continue;
            const Rgb value = direct_value(state, bsdf, wo, wi, s->pdf);
            if (!(value > 0).any()) continue;
            const Ray shadow{origin, s->direction, 0.0f, s->distance * (1 - 1e-4f), view};
            if (is_hidden(shadow, view, result)) continue;
            const float scale = boost * wi.z() / static_cast<float>(count);
            add(state, state.layer, state.throughput * value * s->radiance_over_pdf * scale,
                result);
        }
    }
}

Rgb PathTracer::direct_value(const State& state, const Bsdf& bsdf, const Vec3f& wo, const Vec3f& wi,
                             float light_pdf) const {
    Rgb value = Rgb::Zero();
    const bool can_scatter =
        !options_.direct_light_only && state.diffuse_bounces < options_.max_diffuse_bounces;
    for (const Lobe lobe : {Lobe::Diffuse, Lobe::Glossy}) {
        // Light that a glossy lobe sends on to an earlier receiver is among its photons.
        if (lobe == Lobe::Glossy && caustics_ && state.has_receiver) continue;
        const float probability = lobe_probability(bsdf, lobe);
        if (probability <= 0) continue;
        float weight = 1.0f;
        if (light_pdf > 0 && can_scatter) {
            weight = balance(light_pdf, probability * pdf_lobe(bsdf, lobe, wo, wi));
        }
        value += weight * eval_lobe(bsdf, lobe, wo, wi);
    }
    return value;
}

void PathTracer::add_caustics(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                              const Frame& frame, const Vec3f& wo, std::uint32_t view,
                              PathResult& result) const {
    if (!caustics_ || caustics_->empty()) return;
    if (state.is_diffuse_segment && (point.position - state.receiver).norm() >= caustics_->near_m) {
        return;  // known from the secondary lights
    }
    const std::uint8_t wanted =
        static_cast<std::uint8_t>(view == kAllParts ? kVirtualParts : kRealParts);
    Rgb irradiance = Rgb::Zero(), glossy = Rgb::Zero();
    const bool is_translucent = std::holds_alternative<TranslucentBsdf>(bsdf);
    const bool has_glossy = !state.has_receiver && lobe_probability(bsdf, Lobe::Glossy) > 0;
    const auto visit = [&](const Photon& photon, float kernel) {
        if (view == kAllParts) result.is_touched |= photon.views != kAllParts;
        if (!(photon.views & wanted)) return;
        if (!is_translucent) irradiance += kernel * photon.power;
        if (!has_glossy && !is_translucent) return;
        const Vec3f wi = frame.to_local(photon.to_light.unpack());
        if (is_translucent) {  // what enters depends on the direction
            glossy += kernel * photon.power * eval_lobe(bsdf, Lobe::Diffuse, wo, wi);
            if (!has_glossy) return;
        }
        glossy += kernel * photon.power * eval_lobe(bsdf, Lobe::Glossy, wo, wi);
    };
    if (state.has_receiver) {
        const PhotonGrid& map = state.is_diffuse_segment ? caustics_->wide : caustics_->broad;
        map.gather(point.position, point.geometric_normal, visit);
    } else {
        caustics_->sharp.gather(point.position, point.geometric_normal, visit);
        caustics_->soft.gather(point.position, point.geometric_normal, visit);
    }
    const Rgb reflected = irradiance * eval_lobe(bsdf, Lobe::Diffuse, wo, Vec3f(0, 0, 1)) + glossy;
    const Layer layer = state.is_layer_fixed      ? state.layer
                        : state.is_first_receiver ? Layer::Caustics
                                                  : Layer::Diffuse;
    add(state, layer, state.throughput * reflected, result);
}

void PathTracer::add_exitance(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                              const Vec3f& wo, std::uint32_t view, PathResult& result) const {
    const auto* face = std::get_if<TranslucentBsdf>(&bsdf);
    if (!face || !translucent_) return;
    if (view == kAllParts) result.is_touched |= translucent_->is_touched(point.part);
    const Rgb exitance = translucent_->exitance(scene_, point, view);
    const Layer layer = state.is_layer_fixed ? state.layer : Layer::Diffuse;
    add(state, layer,
        state.throughput * exitance * (fresnel_transmittance(wo.z(), face->eta) / kPif), result);
}

void PathTracer::add_secondary(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                               const PathSampler& sampler, std::uint32_t view,
                               PathResult& result) const {
    if (!caustics_ || caustics_->secondary_choice.empty()) return;
    const std::size_t index =
        caustics_->secondary_choice.pick(sampler.number(state.depth, kSecondaryUse));
    const SecondaryLight& light = caustics_->secondary[index];
    const Vec3f origin = scene_.leave_smooth(point);
    const Vec3f to_light = light.position + scene_.epsilon() * light.normal - origin;
    const float distance = to_light.norm();
    if (distance < caustics_->near_m) return;
    const Vec3f direction = to_light / distance;
    const float cos_here = direction.dot(point.shading_normal);
    const float cos_there = -direction.dot(light.normal);
    if (cos_here <= 0 || cos_there <= 0 || direction.dot(point.geometric_normal) <= 0) return;
    const Rgb value = eval_lobe(bsdf, Lobe::Diffuse, Vec3f(0, 0, 1), Vec3f(0, 0, 1));
    if (!(value > 0).any()) return;
    if (is_hidden({origin, direction, 0.0f, distance * (1 - 1e-4f), view}, view, result)) return;
    if (view == kAllParts) result.is_touched |= light.views != kAllParts;
    const auto wanted = static_cast<std::uint8_t>(view == kAllParts ? kVirtualParts : kRealParts);
    if (!(light.views & wanted)) return;
    const auto probability = static_cast<float>(caustics_->secondary_choice.probability(index));
    const float geometry = cos_here * cos_there / (kPif * distance * distance * probability);
    const Layer layer = state.is_layer_fixed ? state.layer : Layer::Diffuse;
    add(state, layer, state.throughput * value * light.flux * geometry, result);
}

bool PathTracer::scatter(State& state, const ShadingPoint& point, const Bsdf& bsdf,
                         const Frame& frame, const Vec3f& wo, const PathSampler& sampler) const {
    const BsdfSample s = sample(bsdf, wo, sampler.pair(state.depth, kScatterUse),
                                sampler.number(state.depth, kLobeUse));
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
        faint_share > kMinSplitShare && !pending.is_full()) {
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
