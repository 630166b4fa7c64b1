// Where paths go on from glass: many surfaces side by side.
#include "render/path_state.h"

namespace vitrine {
namespace {

/// A branch of a split ray fainter than this is left to chance.
constexpr float kMinSplitShare = 0.01f;

}  // namespace

void PathTracer::pass_glass(Wave& wave, std::span<Flight* const> hits) const {
    PlainLanes& lanes = wave.lanes;
    GlassLanes& bent = wave.bent;
    const int count = static_cast<int>(hits.size());
    for (int i = 0; i < count; ++i) {
        const auto& [ray, state] = *hits[lane(i)];
        set_hit(lanes, i, scene_.shape(ray.part), ray, ray.ray.direction);
        wave.set_random(i, state);
    }
    normalize_facets(lanes, count);
    find_surfaces(lanes, count);
    Lane<std::uint32_t> beyond;
    for (int i = 0; i < count; ++i) {
        const auto& [ray, state] = *hits[lane(i)];
        const MediumTable::Crossing crossing =
            wave.media.cross(state.medium, ray.part, lanes.side[lane(i)] > 0);
        beyond[lane(i)] = crossing.beyond;
        bent.eta[lane(i)] = crossing.eta;
    }
    bend_lanes(lanes, bent, count);
    lanes.random.of.fill(1);
    lanes.random.use.fill(kBranchUse);
    random_pairs(lanes.random, 0, lanes.u, lanes.v, count);
    for (int i = 0; i < count; ++i) branch(hits[lane(i)]->state, i, beyond[lane(i)], wave);
}

void PathTracer::branch(const State& state, int i, std::uint32_t beyond, Wave& wave) const {
    const PlainLanes& lanes = wave.lanes;
    const GlassLanes& bent = wave.bent;
    // `RenderScene::leave`: a refracted ray always leaves for below, a reflected one for above.
    const Vec3f position = lanes.position.at(i), lift = scene_.epsilon() * lanes.geometric.at(i);
    const float eta = bent.eta[lane(i)], f = bent.reflectance[lane(i)];
    if (eta == 1.0f) {  // hidden inside another medium
        wave.add(state, position - lift, bent.refracted.at(i)).medium = beyond;
        return;
    }
    const auto reflect = [&](float share) {
        State& next = wave.add(state, position + lift, bent.reflected.at(i));
        next.throughput *= share;
        next.pass_specular(Layer::Reflection, caustics_ != nullptr);
    };
    // Radiance is compressed into a smaller solid angle in the denser medium (Veach 1997, 5.2).
    const float compression = 1.0f / (eta * eta);
    const auto refract = [&](float share) {
        State& next = wave.add(state, position - lift, bent.refracted.at(i));
        next.throughput *= share * compression;
        next.medium = beyond;
        next.pass_specular(Layer::Refraction, caustics_ != nullptr);
    };
    if (f >= 1) {
        reflect(1);
        return;
    }
    const float faint_share = std::min(f, 1 - f) * state.throughput.maxCoeff();
    if (!state.has_receiver && state.specular_bounces <= options_.split_depth &&
        faint_share > kMinSplitShare) {
        refract(1 - f);
        reflect(f);
    } else if (lanes.u[lane(i)] < f) {
        reflect(1);
    } else {
        refract(1);
    }
}

}  // namespace vitrine
