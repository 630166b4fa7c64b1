#include "render/photon_tracer.h"

#include "render/packed_lanes.h"

namespace vitrine {
namespace {

constexpr int kTogether = 4;

// Random numbers of a vertex.
constexpr int kInterfaceUse = 2;
constexpr int kScatterUse = 3;
constexpr int kRouletteUse = 4;

std::size_t lane(int i) { return static_cast<std::size_t>(i); }

template <typename Flight>
void absorb(Flight& flight, const Rgb& factor, PhotonBalance& balance) {
    const double before = flight.power.sum();
    flight.power *= factor;
    if (!flight.has_arrived) balance.absorbed += before - flight.power.sum();
}

}  // namespace

PhotonTracer::PhotonTracer(const RenderScene& scene, const CausticOptions& options)
    : scene_(scene), options_(options) {
    for (int part = 0; part < static_cast<int>(scene.scene().parts.size()); ++part) {
        Receiver& receiver = receivers_.emplace_back();
        receiver.is_virtual = scene.is_virtual(part);
        const PartShape& shape = scene.shape(part);
        if (scene.dielectric(part)) receiver.surface = Surface::Glass;
        if (shape.is_diffuse) receiver.surface = Surface::Plain;
        if (shape.has_one_albedo) receiver.photon.set_diffuse_albedo(shape.albedo);
    }
}

void PhotonTracer::trace(const PhotonTarget& target, std::uint32_t view, PhotonGroup& group) const {
    group.is_touched.assign(group.indices.size(), 0);
    group.slots.clear();
    group.balance.shot += group.indices.size();
    emit(target, view, group);
    for (int depth = 0; !group.flights_.rays.empty(); ++depth) {
        // The first surfaces are met side by side; behind them neighbours have parted, and Embree's
        // packets of such rays cost more than the rays one by one.
        scene_.closest(std::span(group.flights_.rays), depth < kTogether);
        sort_out(target, depth, group);
        group.next_.clear();
        group.faint_.clear();
        by_lanes(std::span(group.glass_), [&](std::span<const std::uint32_t> numbers) {
            pass_glass(target, depth, view, numbers, group);
        });
        by_lanes(std::span(group.plain_), [&](std::span<const std::uint32_t> numbers) {
            store_plain(view, numbers, group);
        });
        for (const std::uint32_t i : group.others_) {
            Flight flight = group.flights_.carried[i];
            const RayAndHit& met = group.flights_.rays[i];
            Ray ray{met.ray.origin, met.ray.direction};
            if (step(flight, ray, hit_of(met), target, depth, view, group)) {
                group.next_.carried.push_back(flight);
                group.next_.rays.emplace_back(ray.origin, ray.direction, view);
            }
        }
        // The faint branches of neighbours are neighbours too.
        group.next_.append(group.faint_);
        std::swap(group.flights_, group.next_);
    }
}

/// Flights from the light, of those photons that carry something.
void PhotonTracer::emit(const PhotonTarget& target, std::uint32_t view, PhotonGroup& group) const {
    const PhotonEmission emission(scene_, target);
    EmittedLanes& photons = group.emitted_;
    const std::span<const std::uint32_t> indices(group.indices);
    group.flights_.clear();
    for (std::size_t begin = 0; begin < indices.size(); begin += kLanes) {
        const auto together =
            indices.subspan(begin, std::min<std::size_t>(kLanes, indices.size() - begin));
        emission.emit(together, photons);
        for (int i = 0; i < static_cast<int>(together.size()); ++i) {
            const Rgb power = photons.power.at(i).array();
            const float initial = power.maxCoeff();
            if (!(initial > 0)) continue;
            group.flights_.rays.emplace_back(photons.origin.at(i), photons.direction.at(i), view);
            Flight& flight = group.flights_.carried.emplace_back();
            flight.power = power;
            flight.initial = initial;
            flight.slot = static_cast<std::uint32_t>(begin) + static_cast<std::uint32_t>(i);
        }
    }
}

/// Ends the flights that met nothing that counts, and lists the others by what they met.
void PhotonTracer::sort_out(const PhotonTarget& target, int depth, PhotonGroup& group) const {
    for (auto* list : {&group.glass_, &group.plain_, &group.others_}) list->clear();
    PhotonBalance& balance = group.balance;
    for (std::size_t i = 0; i < group.flights_.rays.size(); ++i) {
        const Flight& flight = group.flights_.carried[i];
        const RayAndHit& hit = group.flights_.rays[i];
        if (!hit.is_hit()) {
            if (depth > 0 && !flight.has_arrived) balance.escaped += flight.power.sum();
            continue;
        }
        const Receiver& receiver = receivers_[static_cast<std::size_t>(hit.part)];
        if (receiver.is_virtual) group.is_touched[flight.slot] = 1;
        if (depth == 0) {
            if (hit.part != target.part) continue;
            ++balance.met;
            balance.emitted += flight.power.sum();
        }
        if (depth > options_.max_interfaces) {
            if (!flight.has_arrived) balance.ended += flight.power.sum();
            continue;
        }
        const auto number = static_cast<std::uint32_t>(i);
        switch (receiver.surface) {
            case Surface::Glass:
                group.glass_.push_back(number);
                break;
            case Surface::Plain:
                group.plain_.push_back(number);
                break;
            case Surface::Other:
                group.others_.push_back(number);
                break;
        }
    }
}

/// Surfaces that the flights `numbers` met, and their power where they arrive, in lanes.
void PhotonTracer::find_surfaces(std::span<const std::uint32_t> numbers, PhotonGroup& group) const {
    const int count = static_cast<int>(numbers.size());
    PlainLanes& surfaces = group.surfaces_;
    for (int i = 0; i < count; ++i) {
        const Flight& flight = group.flights_.carried[numbers[lane(i)]];
        const RayAndHit& hit = group.flights_.rays[numbers[lane(i)]];
        set_hit(surfaces, i, scene_.shape(hit.part), hit, hit.ray.direction);
        Rgb power = flight.power;
        if (group.media_.absorbs(flight.medium)) {
            power *= scene_.transmittance(group.media_.media(flight.medium), hit.distance());
            if (!flight.has_arrived) {
                group.balance.absorbed += double(flight.power.sum()) - double(power.sum());
            }
        }
        surfaces.throughput.set(i, power);
    }
    normalize_facets(surfaces, count);
    vitrine::find_surfaces(surfaces, count);
}

void PhotonTracer::pass_glass(const PhotonTarget& target, int depth, std::uint32_t view,
                              std::span<const std::uint32_t> numbers, PhotonGroup& group) const {
    const int count = static_cast<int>(numbers.size());
    PlainLanes& surfaces = group.surfaces_;
    GlassLanes& glass = group.glass_lanes_;
    find_surfaces(numbers, group);
    surfaces.random.stream.fill(PathSampler(target.key, 0).mixed_stream());
    surfaces.random.depth.fill(static_cast<std::uint32_t>(depth));
    surfaces.random.use.fill(kInterfaceUse);
    surfaces.random.of.fill(1);
    Lane<std::uint32_t> beyond;
    for (int i = 0; i < count; ++i) {
        const Flight& flight = group.flights_.carried[numbers[lane(i)]];
        surfaces.random.index[lane(i)] = group.indices[flight.slot];
        const MediumTable::Crossing crossing = group.media_.cross(
            flight.medium, group.flights_.rays[numbers[lane(i)]].part, surfaces.side[lane(i)] > 0);
        beyond[lane(i)] = crossing.beyond;
        glass.eta[lane(i)] = crossing.eta;
        glass.initial[lane(i)] = flight.initial;
    }
    random_pairs(surfaces.random, 0, surfaces.u, surfaces.v, count);
    bend_lanes(surfaces, glass, count);
    branch_lanes(surfaces, glass, count);
    const auto send_on = [&](const Flight& from, const BranchLanes& branch, int i,
                             PhotonGroup::Flights& flights) {
        const bool is_refracted = branch.is_refracted[lane(i)] != 0;
        // `RenderScene::leave`: a refracted ray always leaves for below, a reflected one for above.
        const float side = is_refracted ? -scene_.epsilon() : scene_.epsilon();
        flights.rays.emplace_back(surfaces.position.at(i) + side * surfaces.geometric.at(i),
                                  (is_refracted ? glass.refracted : glass.reflected).at(i), view);
        Flight& flight = flights.carried.emplace_back(from);
        flight.power = branch.power.at(i).array();
        if (is_refracted) flight.medium = beyond[lane(i)];
    };
    for (int i = 0; i < count; ++i) {
        const Flight& flight = group.flights_.carried[numbers[lane(i)]];
        if (!flight.has_arrived) group.balance.chance += glass.chance[lane(i)];
        if (glass.strong.is_open[lane(i)]) send_on(flight, glass.strong, i, group.next_);
        if (glass.faint.is_open[lane(i)]) send_on(flight, glass.faint, i, group.faint_);
    }
}

void PhotonTracer::store_plain(std::uint32_t view, std::span<const std::uint32_t> numbers,
                               PhotonGroup& group) const {
    const int count = static_cast<int>(numbers.size());
    PlainLanes& surfaces = group.surfaces_;
    PackedLanes to_light, normals;
    find_surfaces(numbers, group);
    pack_directions(surfaces.direction, -1.0f, to_light, count);
    pack_directions(surfaces.geometric, 1.0f, normals, count);
    for (int i = 0; i < count; ++i) {
        const Flight& flight = group.flights_.carried[numbers[lane(i)]];
        const RayAndHit& hit = group.flights_.rays[numbers[lane(i)]];
        Photon& photon =
            group.arrivals.emplace_back(receivers_[static_cast<std::size_t>(hit.part)].photon);
        photon.position = surfaces.position.at(i);
        photon.power = surfaces.throughput.at(i).array();
        photon.to_light = to_light.at(i);
        photon.normal = normals.at(i);
        if (!scene_.shape(hit.part).has_one_albedo) {
            photon.set_diffuse_albedo(scene_.diffuse_albedo(hit.part, hit_of(hit)));
        }
        finish(photon, flight, view, group);
    }
}

/// What arrivals of all kinds share.
void PhotonTracer::finish(Photon& photon, const Flight& flight, std::uint32_t view,
                          PhotonGroup& group) {
    photon.views = static_cast<std::uint8_t>(view);
    photon.is_glossy = flight.is_glossy;
    group.slots.push_back(flight.slot);
    if (!flight.has_arrived) group.balance.stored += photon.power.sum();
}

/// Surfaces of other kinds; false when the flight ends.
bool PhotonTracer::step(Flight& flight, Ray& ray, const Hit& hit, const PhotonTarget& target,
                        int depth, std::uint32_t view, PhotonGroup& group) const {
    const ShadingPoint point = scene_.surface(hit, ray.direction);
    if (group.media_.absorbs(flight.medium)) {
        absorb(flight, scene_.transmittance(group.media_.media(flight.medium), hit.distance),
               group.balance);
    }
    const Bsdf bsdf = scene_.bsdf(point, hit);
    if (is_smooth(bsdf)) {
        absorb(flight, std::get<MirrorBsdf>(bsdf).reflectance, group.balance);
        ray.direction = mirror_direction(point, ray.direction);
        ray.origin = scene_.leave(point, ray.direction);
        return (flight.power > 0).any();
    }
    if (depth > 0) {
        Photon& photon = group.arrivals.emplace_back();
        photon.position = point.position;
        photon.power = flight.power;
        photon.to_light = PackedDirection(-ray.direction);
        photon.normal = PackedDirection(point.geometric_normal);
        photon.set_diffuse_albedo(diffuse_reflectance(bsdf));
        photon.keeps_direction = true;
        finish(photon, flight, view, group);
        flight.has_arrived = true;
    }
    if (!(lobe_probability(bsdf, Lobe::Glossy) > 0)) return false;
    return scatter(flight, ray, point, bsdf, depth, {target.key, group.indices[flight.slot]},
                   group.balance);
}

bool PhotonTracer::scatter(Flight& flight, Ray& ray, const ShadingPoint& point, const Bsdf& bsdf,
                           int depth, const PathSampler& sampler, PhotonBalance& balance) const {
    const Frame frame(point.shading_normal);
    const Vec3f wo = frame.to_local(-ray.direction);
    BsdfSample s = sample(bsdf, wo, sampler.pair(depth, kScatterUse), 0x1.fffffep-1f);
    s.weight *= lobe_probability(bsdf, Lobe::Glossy);
    const Vec3f direction = frame.to_world(s.wi);
    if (direction.dot(point.geometric_normal) <= 0) s.weight = Rgb::Zero();
    absorb(flight, s.weight, balance);
    if (!(flight.power > 0).any()) return false;
    ray.direction = direction;
    ray.origin = scene_.leave(point, direction);
    flight.is_glossy = true;
    const float survival = flight.power.maxCoeff() / (flight.initial * kSurePower);
    if (survival >= 1) return true;
    // Russian roulette: the power of those that stay makes up for those that go.
    const bool stays = sampler.number(depth, kRouletteUse) < survival;
    const double before = flight.power.sum();
    if (stays) flight.power /= survival;
    if (!flight.has_arrived) balance.chance += before - (stays ? flight.power.sum() : 0.0);
    return stays;
}

}  // namespace vitrine
