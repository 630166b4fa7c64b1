// What paths find at plain diffuse surfaces: the same as `PathTracer::step` at others, for many
// side by side.
#include "render/path_state.h"

namespace vitrine {
namespace {

/// As the other `sample_light`, of lights of any kind.
void sample_light(PlainLanes& lanes, const LightSampler& lights, std::size_t light, int count) {
    for (int i = 0; i < count; ++i) {
        const auto s =
            lights.sample(light, lanes.origin.at(i), {lanes.u[lane(i)], lanes.v[lane(i)]});
        lanes.lit[lane(i)] = s ? 1.0f : 0.0f;
        if (!s) continue;
        lanes.to_light.set(i, s->direction);
        lanes.light.set(i, s->radiance_over_pdf);
        lanes.distance[lane(i)] = s->distance;
        lanes.pdf[lane(i)] = s->pdf;
    }
}

ShadingPoint point_at(const PlainLanes& lanes, int i, int part) {
    ShadingPoint point;
    point.part = part;
    point.position = lanes.position.at(i);
    point.smooth_position = lanes.smooth.at(i);
    point.geometric_normal = lanes.geometric.at(i);
    point.shading_normal = lanes.shading.at(i);
    return point;
}

}  // namespace

std::vector<std::optional<LaneLight>> lane_lights(const LightSampler& lights) {
    std::vector<std::optional<LaneLight>> result;
    for (std::size_t i = 0; i < lights.count(); ++i) result.push_back(lane_light(lights.light(i)));
    return result;
}

void PathTracer::shade_plain(Wave& wave, std::span<Flight* const> hits) const {
    PlainLanes& lanes = wave.lanes;
    const int count = static_cast<int>(hits.size());
    const int most_bounces = options_.direct_light_only ? 0 : options_.max_diffuse_bounces;
    for (int i = 0; i < count; ++i) {
        State& state = hits[lane(i)]->state;
        const RayAndHit& ray = hits[lane(i)]->ray;
        const PartShape& shape = scene_.shape(ray.part);
        set_hit(lanes, i, shape, ray, ray.ray.direction);
        if (shape.has_one_albedo) {
            lanes.albedo.set(i, shape.albedo);
        } else {
            lanes.albedo.set(i, scene_.diffuse_albedo(ray.part, hit_of(ray)));
        }
        lanes.throughput.set(i, state.throughput);
        wave.set_random(i, state);
        if (varies_light_) {
            lanes.is_seen[lane(i)] = state.has_receiver ? 0 : 1;
            lanes.light_samples[lane(i)] = static_cast<std::uint32_t>(
                state.has_receiver ? 1 : wave.task(state).wish.light_samples);
        }
        lanes.can_scatter[lane(i)] = state.diffuse_bounces < most_bounces ? 1 : 0;
        if (!state.is_layer_fixed) {
            state.layer = state.has_receiver ? Layer::Diffuse : Layer::Shadow;
        }
    }
    normalize_facets(lanes, count);
    find_surfaces(lanes, count);
    find_origins(lanes, scene_.epsilon(), count);
    add_direct(wave, hits);
    Lane<std::uint32_t> is_open = lanes.can_scatter;
    for (int i = 0; caustics_ && i < count; ++i) {
        const State& state = hits[lane(i)]->state;
        const ShadingPoint point = point_at(lanes, i, hits[lane(i)]->ray.part);
        add_caustics(state, point, hits[lane(i)]->ray.ray.origin,
                     DiffuseBsdf{lanes.albedo.at(i).array()}, Frame(point.shading_normal),
                     Vec3f(0, 0, 1), wave.sink(state));
    }
    if (options_.keeps_soft_apart) find_soft(wave, hits, is_open);
    for (int i = 0; caustics_ && i < count; ++i) {
        if (!is_open[lane(i)]) continue;
        add_secondary(hits[lane(i)]->state, point_at(lanes, i, hits[lane(i)]->ray.part),
                      DiffuseBsdf{lanes.albedo.at(i).array()}, wave);
    }
    scatter(wave, hits, is_open);
}

void PathTracer::find_soft(Wave& wave, std::span<Flight* const> hits,
                           Lane<std::uint32_t>& is_open) const {
    const PlainLanes& lanes = wave.lanes;
    for (int i = 0; i < static_cast<int>(hits.size()); ++i) {
        State& state = hits[lane(i)]->state;
        if (!is_open[lane(i)] || state.has_receiver || state.is_layer_fixed) continue;
        SoftLight soft;
        soft.albedo = lanes.albedo.at(i).array();
        soft.position = lanes.position.at(i);
        soft.normal = lanes.shading.at(i);
        wave.sink(state).each(state.views, [&](PathResult& result) { result.set_soft(soft); });
        state.is_soft = wave.task(state).wish.finds_soft;
        if (!state.is_soft) is_open[lane(i)] = 0;
    }
}

void PathTracer::add_direct(Wave& wave, std::span<Flight* const> hits) const {
    const LightSampler& lights = scene_.lights();
    PlainLanes& lanes = wave.lanes;
    const int count = static_cast<int>(hits.size());
    const bool has_choice = lights.count() > 1;
    const std::size_t first_shadow = wave.shadows.size();
    wave.shadow_lanes.clear();
    // All lights at the surface seen; one of them, by turns of chance, at those behind it.
    Lane<std::size_t> picked;
    for (int i = 0; has_choice && i < count; ++i) {
        const State& state = hits[lane(i)]->state;
        if (!state.has_receiver) continue;
        picked[lane(i)] = pick_light(state, wave.task(state).sampler);
    }
    for (std::size_t light = 0; light < lights.count(); ++light) {
        const bool has_size = lights.needs_position(light);
        std::uint32_t most = 1;
        if (has_size) {
            lanes.random.of = lanes.light_samples;
            most =
                *std::max_element(lanes.light_samples.begin(), lanes.light_samples.begin() + count);
        } else {
            lanes.random.of.fill(1);
        }
        const auto share = static_cast<float>(lights.count());
        const std::uint32_t use = light_use(light), use_of_one = light_use(0);
        for (std::size_t i = 0; i < kLanes; ++i) {
            const bool takes_all = !has_choice || lanes.is_seen[i] != 0;
            lanes.random.use[i] = takes_all ? use : use_of_one;
            lanes.scale[i] = (takes_all ? 1.0f : share) / static_cast<float>(lanes.random.of[i]);
        }
        const bool are_in_order = !has_choice && most == 1;
        for (std::uint32_t k = 0; k < most; ++k) {
            if (has_size) random_pairs(lanes.random, k, lanes.u, lanes.v, count);
            if (lane_lights_[light]) {
                sample_light(lanes, *lane_lights_[light], count);
            } else {
                sample_light(lanes, lights, light, count);
            }
            receive_light(lanes, count);
            wave.make_shadow_room(hits.size());
            BareRay* shadow_ray = wave.shadow_rays.end();
            ShadowRay* shadow = wave.shadows.end();
            for (int i = 0; i < count; ++i) {
                if (!(lanes.lit[lane(i)] > 0) || k >= lanes.random.of[lane(i)]) continue;
                if (has_choice && !lanes.is_seen[lane(i)] && picked[lane(i)] != light) continue;
                const auto& [ray, state] = *hits[lane(i)];
                const float end = short_of(lanes.distance[lane(i)]);
                new (shadow_ray++)
                    BareRay(lanes.origin.at(i), lanes.to_light.at(i), end, ray.ray.mask);
                new (shadow++)
                    ShadowRay(lanes.light.at(i).array(), end, state, state.views, state.layer);
                if (!are_in_order) wave.shadow_lanes.push_back(i);
            }
            wave.shadow_rays.take(shadow_ray);
            wave.shadows.take(shadow);
        }
    }
    if (wave.shadow_lanes.size() > hits.size()) wave.sort_shadows(first_shadow, count);
}

void PathTracer::scatter(Wave& wave, std::span<Flight* const> hits,
                         const Lane<std::uint32_t>& is_open) const {
    PlainLanes& lanes = wave.lanes;
    const int count = static_cast<int>(hits.size());
    const auto end = is_open.begin() + count;
    if (std::find(is_open.begin(), end, 1u) == end) return;
    lanes.random.of.fill(1);
    lanes.random.use.fill(kScatterUse);
    random_pairs(lanes.random, 0, lanes.u, lanes.v, count);
    scatter_lanes(lanes, count);
    const auto has_receiver = [](const Flight* hit) { return hit->state.has_receiver; };
    if (std::any_of(hits.begin(), hits.end(), has_receiver)) {
        lanes.random.use.fill(kRouletteUse);
        random_pairs(lanes.random, 0, lanes.u, lanes.v, count);
    }
    Flight* next = wave.next.end();
    for (int i = 0; i < count; ++i) {
        if (!is_open[lane(i)] || !(lanes.open[lane(i)] > 0)) continue;
        const auto& [ray, state] = *hits[lane(i)];
        Rgb throughput = lanes.throughput.at(i).array();
        if (state.has_receiver) {
            const float survival = survival_of(throughput);
            if (lanes.u[lane(i)] >= survival) continue;
            throughput /= survival;
        }
        new (next) Flight(lanes.origin.at(i), lanes.scattered.at(i), ray.ray.mask, state);
        next->state.throughput = throughput;
        next->state.leave_receiver(Lobe::Diffuse, lanes.scattered_pdf[lane(i)],
                                   caustics_ != nullptr);
        ++next;
    }
    wave.next.take(next);
}

}  // namespace vitrine
