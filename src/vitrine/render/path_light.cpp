// What a path finds at one surface: lights, photons, what translucent bodies send.
#include "optics/fresnel.h"
#include "render/path_state.h"

#include <numeric>

namespace vitrine {
namespace {

float balance(float a, float b) { return a + b > 0 ? a / (a + b) : 0.0f; }

}  // namespace

void PathTracer::add_emission(const State& state, const RayAndHit& ray, Sink sink) const {
    if (state.is_covered) return;
    const LightSampler& lights = scene_.lights();
    const Vec3f &origin = ray.ray.origin, &direction = ray.ray.direction;
    for (const std::size_t i : lights.lamps()) {
        const auto hit = lights.hit(i, origin, direction, ray.distance());
        if (!hit) continue;
        float weight = 1.0f;
        if (state.pdf > 0) {
            weight = balance(state.pdf, lights.pdf(i, origin, direction, hit->distance));
        }
        sink.add(state, state.layer, state.throughput * hit->radiance * weight);
    }
}

void PathTracer::add_environment(const State& state, const RayAndHit& ray, Sink sink) const {
    const LightSampler& lights = scene_.lights();
    Rgb radiance =
        options_.direct_light_only && state.has_receiver ? Rgb(Rgb::Zero()) : lights.ambient();
    if (!state.is_covered) {
        for (const std::size_t i : lights.environments()) {
            float weight = 1.0f;
            if (state.pdf > 0) {
                weight =
                    balance(state.pdf, lights.pdf(i, ray.ray.origin, ray.ray.direction, 1e30f));
            }
            radiance += lights.environment_radiance(i, ray.ray.direction) * weight;
        }
    }
    // An environment seen from the first surface is direct light, whatever its layer says by now.
    const Layer layer = state.is_from_first && !state.is_layer_fixed ? Layer::Shadow : state.layer;
    sink.add(state, layer, state.throughput * radiance);
}

void PathTracer::add_shadows(Wave& wave) const {
    scene_.occluded(wave.shadow_rays.items());
    const BareRay* next_ray = wave.shadow_rays.begin();
    const std::span<PathPair> results = wave.results;
    for (const ShadowRay& shadow : wave.shadows) {
        const BareRay& ray = *next_ray++;
        std::uint32_t lit = shadow.views;
        if (ray.is_hidden()) {
            if (shadow.views != kAllParts) continue;
            // What a virtual part hides may lie open in the scene without.
            lit = kRealParts;
            if (scene_.is_occluded(
                    {ray.origin, ray.direction, 0.0f, shadow.distance, kRealParts})) {
                continue;
            }
        }
        Sink sink{results[shadow.path]};
        if (lit != shadow.path_views) sink.part();
        sink.add(shadow.is_soft, shadow.layer, shadow.light, lit);
    }
    wave.shadows.clear();
    wave.shadow_rays.clear();
}

std::size_t PathTracer::pick_light(const State& state, const PathSampler& sampler) const {
    const std::size_t count = scene_.lights().count();
    const float u = sampler.number(state.depth, kPickUse);
    return std::min(count - 1, static_cast<std::size_t>(u * static_cast<float>(count)));
}

void PathTracer::Wave::sort_shadows(std::size_t first, int lane_count) {
    std::vector<std::size_t> place(static_cast<std::size_t>(lane_count) + 1, 0);
    for (const int i : shadow_lanes) ++place[static_cast<std::size_t>(i) + 1];
    std::partial_sum(place.begin(), place.end(), place.begin());
    const std::vector<ShadowRay> old(shadows.begin() + first, shadows.end());
    const std::vector<BareRay> old_rays(shadow_rays.begin() + first, shadow_rays.end());
    for (std::size_t k = 0; k < old.size(); ++k) {
        const std::size_t to = first + place[static_cast<std::size_t>(shadow_lanes[k])]++;
        shadows[to] = old[k];
        shadow_rays[to] = old_rays[k];
    }
}

void PathTracer::add_direct(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                            const Frame& frame, const Vec3f& wo, int light_samples,
                            Wave& wave) const {
    const LightSampler& lights = scene_.lights();
    const PathSampler& sampler = wave.task(state).sampler;
    if (lights.count() == 0) return;
    // All lights at the surface seen; one of them, by turns of chance, at those behind it.
    const bool takes_all = !state.has_receiver || lights.count() == 1;
    std::size_t begin = 0, end = lights.count();
    float boost = 1.0f;
    if (!takes_all) {
        begin = pick_light(state, sampler);
        end = begin + 1;
        boost = static_cast<float>(lights.count());
    }
    const Vec3f origin = scene_.leave_smooth(point);
    for (std::size_t i = begin; i < end; ++i) {
        const auto use = static_cast<int>(light_use(takes_all ? i : 0));
        const int count = lights.needs_position(i) ? light_samples : 1;
        const float scale = boost / static_cast<float>(count);
        for (int k = 0; k < count; ++k) {
            Vec2f u(0.5f, 0.5f);
            if (lights.needs_position(i)) u = sampler.pair(state.depth, use, count, k);
            const auto s = lights.sample(i, origin, u);
            if (!s) continue;
            const Vec3f wi = frame.to_local(s->direction);
            if (wi.z() <= 0 || s->direction.dot(point.geometric_normal) <= 0) continue;
            const Rgb value = direct_value(state, bsdf, wo, wi, s->pdf);
            if (!(value > 0).any()) continue;
            wave.make_shadow_room(1);
            wave.add_shadow(state, state.views, state.layer,
                            state.throughput * value * s->radiance_over_pdf * (scale * wi.z()),
                            origin, s->direction, s->distance);
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

void PathTracer::add_caustics(const State& state, const ShadingPoint& point, const Vec3f& from,
                              const Bsdf& bsdf, const Frame& frame, const Vec3f& wo,
                              Sink sink) const {
    if (!caustics_ || caustics_->empty()) return;
    if (state.is_diffuse_segment && (point.position - from).norm() >= caustics_->near_m) {
        return;  // known from the secondary lights
    }
    const bool is_translucent = std::holds_alternative<TranslucentBsdf>(bsdf);
    const bool has_glossy = !state.has_receiver && lobe_probability(bsdf, Lobe::Glossy) > 0;
    struct Sums {
        Rgb irradiance = Rgb::Zero(), glossy = Rgb::Zero();
    };
    const std::uint32_t first_view = state.views & kVirtualParts ? kVirtualParts : kRealParts;
    Sums first, without;  // the second of a path of both scenes
    bool is_different = false;
    const auto visit = [&](const Photon& photon, float kernel) {
        if (!(photon.views & state.views)) return;
        Sums sums;
        if (!is_translucent) sums.irradiance = kernel * photon.power;
        if (has_glossy || is_translucent) {
            const Vec3f wi = frame.to_local(photon.to_light.unpack());
            if (is_translucent) {  // what enters depends on the direction
                sums.glossy = kernel * photon.power * eval_lobe(bsdf, Lobe::Diffuse, wo, wi);
            }
            if (has_glossy) {
                sums.glossy += kernel * photon.power * eval_lobe(bsdf, Lobe::Glossy, wo, wi);
            }
        }
        const auto add_to = [&](Sums& total) {
            total.irradiance += sums.irradiance;
            total.glossy += sums.glossy;
        };
        if (photon.views & first_view) add_to(first);
        if (state.views != kAllParts) return;
        if (photon.views & kRealParts) add_to(without);
        is_different |= photon.views != kAllParts;
    };
    if (state.has_receiver) {
        const PhotonGrid& map = state.is_diffuse_segment ? caustics_->wide : caustics_->broad;
        map.gather(point.position, point.geometric_normal, visit);
    } else {
        caustics_->sharp.gather(point.position, point.geometric_normal, visit);
        caustics_->soft.gather(point.position, point.geometric_normal, visit);
    }
    const Rgb value = eval_lobe(bsdf, Lobe::Diffuse, wo, Vec3f(0, 0, 1));
    const Layer layer = state.is_layer_fixed  ? state.layer
                        : !state.has_receiver ? Layer::Caustics
                                              : Layer::Diffuse;
    const auto reflected = [&](const Sums& sums) -> Rgb {
        return state.throughput * (sums.irradiance * value + sums.glossy);
    };
    if (!is_different) {
        sink.add(state, layer, reflected(first));
        return;
    }
    sink.add_in(kVirtualParts, state, layer, reflected(first));
    sink.add_in(kRealParts, state, layer, reflected(without));
}

void PathTracer::add_exitance(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                              const Vec3f& wo, Sink sink) const {
    const auto* face = std::get_if<TranslucentBsdf>(&bsdf);
    if (!face || !translucent_) return;
    const Layer layer = state.is_layer_fixed ? state.layer : Layer::Diffuse;
    const Rgb share =
        state.throughput * Rgb::Constant(fresnel_transmittance(wo.z(), face->eta) / kPif);
    const auto exitance = [&](std::uint32_t views) -> Rgb {
        return share * translucent_->exitance(scene_, point, mask_of(views));
    };
    if (state.views != kAllParts || !translucent_->is_touched(point.part)) {
        sink.add(state, layer, exitance(state.views));
        return;
    }
    sink.add_in(kVirtualParts, state, layer, exitance(kVirtualParts));
    sink.add_in(kRealParts, state, layer, exitance(kRealParts));
}

void PathTracer::add_secondary(const State& state, const ShadingPoint& point, const Bsdf& bsdf,
                               Wave& wave) const {
    if (!caustics_ || caustics_->secondary_choice.empty()) return;
    float u = wave.task(state).sampler.number(state.depth, kSecondaryUse);
    const std::size_t index = caustics_->secondary_choice.sample(u);
    const SecondaryLight& light = caustics_->secondary[index];
    const std::uint32_t views = light.views & state.views;
    if (views == 0) return;
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
    const auto probability = static_cast<float>(caustics_->secondary_choice.probability(index));
    const float geometry = cos_here * cos_there / (kPif * distance * distance * probability);
    const Layer layer = state.is_layer_fixed ? state.layer : Layer::Diffuse;
    wave.make_shadow_room(1);
    wave.add_shadow(state, views, layer, state.throughput * value * light.flux * geometry, origin,
                    direction, distance);
}

}  // namespace vitrine
