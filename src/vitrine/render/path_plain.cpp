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

}  // namespace

std::vector<std::optional<LaneLight>> lane_lights(const LightSampler& lights) {
    std::vector<std::optional<LaneLight>> result;
    for (std::size_t i = 0; i < lights.count(); ++i) result.push_back(lane_light(lights.light(i)));
    return result;
}

void PathTracer::shade_plain(Wave& wave) const {
    for_each_batch(wave.plain, [&](std::span<const Meeting> hits) { shade_plain(wave, hits); });
    wave.plain.clear();
}

void PathTracer::shade_plain(Wave& wave, std::span<const Meeting> hits) const {
    PlainLanes& lanes = wave.lanes;
    const int count = static_cast<int>(hits.size());
    for (int i = 0; i < count; ++i) {
        State& state = *hits[lane(i)].state;
        const RayAndHit& ray = *hits[lane(i)].ray;
        const PartShape& shape = scene_.shape(ray.part);
        set_hit(lanes, i, shape, ray, ray.ray.direction);
        lanes.albedo.set(
            i, shape.has_one_albedo ? shape.albedo : scene_.diffuse_albedo(ray.part, hit_of(ray)));
        lanes.throughput.set(i, state.throughput);
        wave.set_random(i, state);
        lanes.can_scatter[lane(i)] =
            !options_.direct_light_only && state.diffuse_bounces < options_.max_diffuse_bounces ? 1
                                                                                                : 0;
        if (!state.is_layer_fixed) {
            state.layer = state.has_receiver ? Layer::Diffuse : Layer::Shadow;
        }
    }
    normalize_facets(lanes, count);
    find_surfaces(lanes, count);
    find_origins(lanes, scene_.epsilon(), count);
    add_direct(wave, hits);
    Lane<std::uint32_t> is_open = lanes.can_scatter;
    for (int i = 0; i < count; ++i) {
        State& state = *hits[lane(i)].state;
        const DiffuseBsdf bsdf{lanes.albedo.at(i).array()};
        ShadingPoint point;
        if (caustics_) {
            point.part = hits[lane(i)].ray->part;
            point.position = lanes.position.at(i);
            point.smooth_position = lanes.smooth.at(i);
            point.geometric_normal = lanes.geometric.at(i);
            point.shading_normal = lanes.shading.at(i);
            add_caustics(state, point, hits[lane(i)].ray->ray.origin, bsdf,
                         Frame(point.shading_normal), Vec3f(0, 0, 1), wave.sink(state));
        }
        if (options_.keeps_soft_apart && is_open[lane(i)] && !state.has_receiver &&
            !state.is_layer_fixed) {
            wave.sink(state).each(state.views, [&](PathResult& result) {
                result.soft.is_present = true;
                result.soft.albedo = bsdf.albedo;
                result.soft.position = lanes.position.at(i);
                result.soft.normal = lanes.shading.at(i);
            });
            state.is_soft = wave.task(state).wish.finds_soft;
            if (!state.is_soft) is_open[lane(i)] = 0;
        }
        if (caustics_ && is_open[lane(i)]) add_secondary(state, point, bsdf, wave);
    }
    scatter(wave, hits, is_open);
}

void PathTracer::add_direct(Wave& wave, std::span<const Meeting> hits) const {
    const LightSampler& lights = scene_.lights();
    PlainLanes& lanes = wave.lanes;
    const int count = static_cast<int>(hits.size());
    const bool has_choice = lights.count() > 1;
    const std::size_t first_shadow = wave.shadows.size();
    wave.shadow_lanes.clear();
    // All lights at the surface seen; one of them, by turns of chance, at those behind it.
    Lane<std::size_t> picked;
    for (int i = 0; has_choice && i < count; ++i) {
        const State& state = *hits[lane(i)].state;
        if (!state.has_receiver) continue;
        picked[lane(i)] = pick_light(state, wave.task(state).sample.sampler);
    }
    for (std::size_t light = 0; light < lights.count(); ++light) {
        const bool has_size = lights.needs_position(light);
        std::uint32_t most = 1;
        for (int i = 0; i < count; ++i) {
            const State& state = *hits[lane(i)].state;
            const bool takes_all = !has_choice || !state.has_receiver;
            const int wish = wave.task(state).wish.light_samples;
            const auto of = static_cast<std::uint32_t>(has_size && !state.has_receiver ? wish : 1);
            lanes.random.of[lane(i)] = of;
            lanes.random.use[lane(i)] = light_use(takes_all ? light : 0);
            lanes.scale[lane(i)] = (takes_all ? 1.0f : float(lights.count())) / float(of);
            most = std::max(most, of);
        }
        for (std::uint32_t k = 0; k < most; ++k) {
            if (has_size) random_pairs(lanes.random, k, lanes.u, lanes.v, count);
            if (lane_lights_[light]) {
                sample_light(lanes, *lane_lights_[light], count);
            } else {
                sample_light(lanes, lights, light, count);
            }
            receive_light(lanes, count);
            for (int i = 0; i < count; ++i) {
                const State& state = *hits[lane(i)].state;
                if (!(lanes.lit[lane(i)] > 0) || k >= lanes.random.of[lane(i)]) continue;
                if (has_choice && state.has_receiver && picked[lane(i)] != light) continue;
                wave.add_shadow(state, state.views, state.layer, lanes.light.at(i).array(),
                                lanes.origin.at(i), lanes.to_light.at(i), lanes.distance[lane(i)]);
                wave.shadow_lanes.push_back(i);
            }
        }
    }
    if (wave.shadow_lanes.size() > hits.size()) wave.sort_shadows(first_shadow, count);
}

void PathTracer::scatter(Wave& wave, std::span<const Meeting> hits,
                         const Lane<std::uint32_t>& is_open) const {
    PlainLanes& lanes = wave.lanes;
    const int count = static_cast<int>(hits.size());
    const auto end = is_open.begin() + count;
    if (std::find(is_open.begin(), end, 1u) == end) return;
    lanes.random.of.fill(1);
    lanes.random.use.fill(kScatterUse);
    random_pairs(lanes.random, 0, lanes.u, lanes.v, count);
    scatter_lanes(lanes, count);
    const auto has_receiver = [](const Meeting& hit) { return hit.state->has_receiver; };
    if (std::any_of(hits.begin(), hits.end(), has_receiver)) {
        lanes.random.use.fill(kRouletteUse);
        random_pairs(lanes.random, 0, lanes.u, lanes.v, count);
    }
    for (int i = 0; i < count; ++i) {
        if (!is_open[lane(i)] || !(lanes.open[lane(i)] > 0)) continue;
        const State& state = *hits[lane(i)].state;
        Rgb throughput = lanes.throughput.at(i).array();
        if (state.has_receiver) {
            const float survival = survival_of(throughput);
            if (lanes.u[lane(i)] >= survival) continue;
            throughput /= survival;
        }
        State& next = wave.add(state, lanes.origin.at(i), lanes.scattered.at(i));
        next.throughput = throughput;
        next.leave_receiver(Lobe::Diffuse, lanes.scattered_pdf[lane(i)], caustics_ != nullptr);
    }
}

}  // namespace vitrine
