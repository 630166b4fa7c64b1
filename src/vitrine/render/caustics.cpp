#include "render/caustics.h"

#include "base/parallel.h"
#include "render/interface.h"
#include "render/photon_targets.h"
#include "render/plain_lanes.h"
#include "render/sampler.h"

#include <span>

namespace vitrine {
namespace {

/// Faint branches of an interface survive with this many times their share of the power.
constexpr float kFaintBranchBoost = 4.0f;
/// The share below which a branch is left to chance at all.
constexpr float kSurePower = 0.25f;

/// Random numbers of a vertex for its interface; those for scattering follow.
constexpr int kInterfaceUse = 2;

/// One ray under way through smooth and glossy parts.
struct Flight {
    Vec3f origin, direction;
    Rgb power;
    Media media;
    float initial = 0;       ///< power of the photon at first, of its strongest channel
    std::uint32_t slot = 0;  ///< of the photon in its group
    int depth = 0;
    bool is_glossy = false;
    bool has_arrived = false;  ///< stored at a receiver before: later stores are no new power
};

/// Photons that fly side by side, and what became of them.
struct Group {
    std::vector<std::uint64_t> indices;
    std::vector<std::uint8_t> is_touched;  ///< met a virtual part
    std::vector<Photon> arrivals;
    std::vector<std::uint32_t> slots;  ///< whose arrival each is
    PlainLanes lanes = {};
};

class Tracer {
  public:
    Tracer(const RenderScene& scene, const CausticOptions& options)
        : scene_(scene), options_(options) {}

    /// Follows the photons `group.indices` of `target` among the parts of `view`. All go on by one
    /// surface at a time: neighbours take much the same way, and are traced together.
    void trace(const PhotonTarget& target, std::uint32_t view, Group& group,
               PhotonBalance& balance) const {
        group.is_touched.assign(group.indices.size(), 0);
        group.arrivals.clear();
        group.slots.clear();
        std::vector<Flight> flights, next, faint;
        std::vector<Ray> rays;
        std::vector<Hit> hits;
        PlainLanes& lanes = group.lanes;
        emit(target, group.indices, flights);
        balance.shot += group.indices.size();
        for (int generation = 0; !flights.empty(); ++generation) {
            rays.clear();
            for (const Flight& f : flights) {
                rays.push_back({f.origin, f.direction, 0.0f, 1e30f, view});
            }
            hits.resize(rays.size());
            closest(generation, rays, hits);
            for (const Hit& hit : hits) scene_.prefetch_triangle(hit);
            for (const Hit& hit : hits) scene_.prefetch_vertices(hit);
            next.clear();
            faint.clear();
            for (std::size_t i = 0; i < flights.size(); ++i) {
                if (i % kLanes == 0) look_ahead(target, group, flights, hits, i, lanes);
                // Copied before it is written to: what was just written would have to be waited
                // for.
                Flight& flight = next.emplace_back(flights[i]);
                if (hits[i].is_hit() && scene_.is_virtual(hits[i].part)) {
                    group.is_touched[flight.slot] = 1;
                }
                if (!goes_on(target, flight, hits[i], balance) ||
                    !step(flight, hits[i], target, lanes, i % kLanes, faint, group, view,
                          balance)) {
                    next.pop_back();
                }
            }
            // The faint branches of neighbours are neighbours too.
            next.insert(next.end(), faint.begin(), faint.end());
            flights.swap(next);
        }
    }

  private:
    /// The first surfaces are met side by side; behind them neighbours have parted, and Embree's
    /// packets of such rays cost more than the rays one by one.
    void closest(int generation, const std::vector<Ray>& rays, std::vector<Hit>& hits) const {
        constexpr int kTogether = 4;
        if (generation < kTogether) {
            scene_.closest(rays, hits);
            return;
        }
        for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = scene_.closest(rays[i]);
    }

    /// What flights from `begin` on meet, and the random numbers that an interface takes.
    void look_ahead(const PhotonTarget& target, const Group& group,
                    const std::vector<Flight>& flights, const std::vector<Hit>& hits,
                    std::size_t begin, PlainLanes& lanes) const {
        const std::size_t count = std::min<std::size_t>(kLanes, flights.size() - begin);
        lanes.random.stream.fill(PathSampler(target.key, 0).mixed_stream());
        lanes.random.use.fill(kInterfaceUse);
        lanes.random.of.fill(1);
        for (std::size_t i = 0; i < count; ++i) {
            const Flight& flight = flights[begin + i];
            const Hit& hit = hits[begin + i];
            lanes.random.index[i] = static_cast<std::uint32_t>(group.indices[flight.slot]);
            lanes.random.depth[i] = static_cast<std::uint32_t>(flight.depth);
            if (!hit.is_hit()) continue;
            set_hit(lanes, static_cast<int>(i), scene_.shape(hit.part), hit, flight.direction);
        }
        find_surfaces(lanes, static_cast<int>(count));
        random_pairs(lanes.random, 0, lanes.u, lanes.v, static_cast<int>(count));
    }

    static ShadingPoint point_of(const Hit& hit, const PlainLanes& lanes, std::size_t lane) {
        const auto i = static_cast<int>(lane);
        return {hit.part,
                hit.distance,
                lanes.position.at(i),
                lanes.geometric.at(i),
                lanes.shading.at(i),
                lanes.position.at(i),
                lanes.side[lane] > 0};
    }

    /// Flights from the light, of those photons that carry something.
    void emit(const PhotonTarget& target, std::span<const std::uint64_t> indices,
              std::vector<Flight>& flights) const {
        const LightSampler& lights = scene_.lights();
        const bool has_size = lights.needs_position(target.light);
        const PathSampler first(target.key, 0);
        RandomLanes random;
        random.stream.fill(first.mixed_stream());
        random.depth.fill(0);
        random.use.fill(0);
        random.of.fill(1);
        Lane<float> u, v;
        flights.reserve(indices.size());
        for (std::size_t begin = 0; begin < indices.size(); begin += kLanes) {
            const std::size_t count = std::min<std::size_t>(kLanes, indices.size() - begin);
            for (std::size_t i = 0; i < count; ++i) {
                random.index[i] = static_cast<std::uint32_t>(indices[begin + i]);
            }
            random_pairs(random, 0, u, v, static_cast<int>(count));
            for (std::size_t i = 0; i < count; ++i) {
                const Vec2f on_light =
                    has_size ? first.at(random.index[i]).further_pair(0) : Vec2f(0.5f, 0.5f);
                const EmittedRay emitted = lights.emit(target.light, target.sphere, {u[i], v[i]},
                                                       on_light, scene_.bounding_sphere());
                const Rgb power = emitted.power / static_cast<float>(target.count);
                const float initial = power.maxCoeff();
                if (!(initial > 0)) continue;
                Flight& flight = flights.emplace_back();
                flight.origin = emitted.origin;
                flight.direction = emitted.direction;
                flight.power = power;
                flight.initial = initial;
                flight.slot = static_cast<std::uint32_t>(begin + i);
            }
        }
    }

    /// False when nothing that counts was met.
    bool goes_on(const PhotonTarget& target, const Flight& flight, const Hit& hit,
                 PhotonBalance& balance) const {
        const double power = flight.power.sum();
        if (!hit.is_hit()) {
            if (flight.depth > 0 && !flight.has_arrived) balance.escaped += power;
            return false;
        }
        if (flight.depth == 0) {
            if (hit.part != target.part) return false;
            ++balance.met;
            balance.emitted += power;
        }
        if (flight.depth > options_.max_interfaces) {
            if (!flight.has_arrived) balance.ended += power;
            return false;
        }
        return true;
    }

    void absorb(Flight& flight, const Rgb& factor, PhotonBalance& balance) const {
        const double before = flight.power.sum();
        flight.power *= factor;
        if (!flight.has_arrived) balance.absorbed += before - flight.power.sum();
    }

    /// One surface; false when the flight ends.
    /// @param lane of the flight in `lanes`
    bool step(Flight& flight, const Hit& hit, const PhotonTarget& target, const PlainLanes& lanes,
              std::size_t lane, std::vector<Flight>& pending, Group& group, std::uint32_t view,
              PhotonBalance& balance) const {
        const ShadingPoint point = point_of(hit, lanes, lane);
        if (flight.media.current() != Media::kNone) {
            absorb(flight, scene_.transmittance(flight.media, hit.distance), balance);
        }
        const int depth = flight.depth++;
        if (scene_.dielectric(hit.part)) {
            return pass_interface(flight, point, {lanes.u[lane], lanes.v[lane]}, pending, balance);
        }
        const Bsdf bsdf = scene_.bsdf(point, hit);
        if (is_smooth(bsdf)) {
            absorb(flight, std::get<MirrorBsdf>(bsdf).reflectance, balance);
            flight.direction = mirror_direction(point, flight.direction);
            flight.origin = scene_.leave(point, flight.direction);
            return (flight.power > 0).any();
        }
        const bool has_lobe = lobe_probability(bsdf, Lobe::Glossy) > 0;
        if (depth > 0) {
            Photon photon;
            photon.position = point.position;
            photon.power = flight.power;
            photon.to_light = PackedDirection(-flight.direction);
            photon.normal = PackedDirection(point.geometric_normal);
            photon.set_diffuse_albedo(diffuse_reflectance(bsdf));
            photon.views = static_cast<std::uint8_t>(view);
            photon.is_glossy = flight.is_glossy;
            photon.keeps_direction = !std::holds_alternative<DiffuseBsdf>(bsdf);
            group.arrivals.push_back(photon);
            group.slots.push_back(flight.slot);
            if (!flight.has_arrived) balance.stored += flight.power.sum();
            flight.has_arrived = true;
        }
        if (!has_lobe) return false;
        const PathSampler sampler(target.key,
                                  static_cast<std::uint32_t>(group.indices[flight.slot]));
        return scatter(flight, point, bsdf, depth, sampler, balance);
    }

    /// @param u of kInterfaceUse
    bool pass_interface(Flight& flight, const ShadingPoint& point, const Vec2f& u,
                        std::vector<Flight>& pending, PhotonBalance& balance) const {
        const InterfaceEvent event = cross_interface(scene_, point, flight.direction, flight.media);
        const auto reflect_flight = [&](Flight& f) {
            f.direction = event.reflected;
            f.origin = scene_.leave(point, f.direction);
        };
        const auto refract_flight = [&](Flight& f) {
            f.direction = event.refracted;
            f.origin = scene_.leave(point, f.direction);
            f.media = event.beyond;
        };
        if (!event.is_optical || event.reflectance <= 0) {
            refract_flight(flight);
            return true;
        }
        if (event.reflectance >= 1) {
            reflect_flight(flight);
            return true;
        }
        // Both branches are followed, the faint one with a chance that shrinks with its power.
        const bool is_mostly_reflected = event.reflectance > 0.5f;
        const float strong = is_mostly_reflected ? event.reflectance : 1 - event.reflectance;
        Rgb faint_power = flight.power * (1 - strong);
        const float chance =
            std::min(1.0f, kFaintBranchBoost * faint_power.maxCoeff() / flight.initial);
        const bool stays = u.x() < chance;
        if (gamble(faint_power, flight.has_arrived, stays, chance, balance)) {
            Flight faint = flight;
            faint.power = faint_power;
            is_mostly_reflected ? refract_flight(faint) : reflect_flight(faint);
            pending.push_back(faint);
        }
        flight.power *= strong;
        is_mostly_reflected ? reflect_flight(flight) : refract_flight(flight);
        return survive(
            flight, [&] { return u.y(); }, balance);
    }

    /// Russian roulette: the power of those that stay makes up for those that go.
    static bool gamble(Rgb& power, bool has_arrived, bool stays, float chance,
                       PhotonBalance& balance) {
        const double before = power.sum();
        if (stays) power /= chance;
        if (!has_arrived) balance.chance += before - (stays ? power.sum() : 0.0);
        return stays;
    }

    /// @param draw gives the random number, if it is needed
    template <typename Draw>
    static bool survive(Flight& flight, const Draw& draw, PhotonBalance& balance) {
        const float survival = flight.power.maxCoeff() / (flight.initial * kSurePower);
        return survival >= 1 ||
               gamble(flight.power, flight.has_arrived, draw() < survival, survival, balance);
    }

    bool scatter(Flight& flight, const ShadingPoint& point, const Bsdf& bsdf, int depth,
                 const PathSampler& sampler, PhotonBalance& balance) const {
        const Frame frame(point.shading_normal);
        const Vec3f wo = frame.to_local(-flight.direction);
        BsdfSample s = sample(bsdf, wo, sampler.pair(depth, 3), 0x1.fffffep-1f);
        s.weight *= lobe_probability(bsdf, Lobe::Glossy);
        const Vec3f direction = frame.to_world(s.wi);
        if (direction.dot(point.geometric_normal) <= 0) s.weight = Rgb::Zero();
        absorb(flight, s.weight, balance);
        if (!(flight.power > 0).any()) return false;
        flight.direction = direction;
        flight.origin = scene_.leave(point, direction);
        flight.is_glossy = true;
        return survive(
            flight, [&] { return sampler.number(depth, 4); }, balance);
    }

    const RenderScene& scene_;
    const CausticOptions& options_;
};

}  // namespace

PhotonBalance& PhotonBalance::operator+=(const PhotonBalance& other) {
    emitted += other.emitted;
    stored += other.stored;
    escaped += other.escaped;
    absorbed += other.absorbed;
    ended += other.ended;
    chance += other.chance;
    shot += other.shot;
    met += other.met;
    return *this;
}

CausticPhotons trace_caustics(const RenderScene& scene, const CausticOptions& options,
                              const Progress& progress) {
    CausticPhotons result;
    const Tracer tracer(scene, options);
    const bool has_virtual = scene.has_virtual();
    constexpr std::uint64_t kBlock = 8192;
    constexpr std::size_t kGroup = 1024;  // fits the nearer caches
    constexpr std::uint64_t kChunk = 64 * kBlock;
    struct Block {
        std::vector<Photon> photons;
        PhotonBalance balance;
    };
    // In the scene with virtual parts, and where these are met in the one without.
    const auto trace_both = [&](const PhotonTarget& target, Group& group, Block& block) {
        tracer.trace(target, kAllParts, group, block.balance);
        for (std::size_t k = 0; has_virtual && k < group.arrivals.size(); ++k) {
            if (group.is_touched[group.slots[k]]) group.arrivals[k].views = kVirtualParts;
        }
        block.photons.insert(block.photons.end(), group.arrivals.begin(), group.arrivals.end());
        if (!has_virtual || scene.is_virtual(target.part)) return;
        std::size_t touched = 0;
        for (std::size_t slot = 0; slot < group.indices.size(); ++slot) {
            if (group.is_touched[slot]) group.indices[touched++] = group.indices[slot];
        }
        group.indices.resize(touched);
        PhotonBalance ignored;
        tracer.trace(target, kRealParts, group, ignored);
        block.photons.insert(block.photons.end(), group.arrivals.begin(), group.arrivals.end());
    };
    const std::vector<PhotonTarget> targets = find_targets(scene, options);
    std::size_t done = 0;
    for (const PhotonTarget& target : targets) {
        const std::uint64_t first = target.count * static_cast<std::uint64_t>(options.pass);
        // A chunk at a time: photons wait in their blocks beside the list for its share alone.
        for (std::uint64_t start = 0; start < target.count; start += kChunk) {
            const std::uint64_t count = std::min<std::uint64_t>(kChunk, target.count - start);
            std::vector<Block> blocks((count + kBlock - 1) / kBlock);
            const std::vector<std::uint64_t> order = coherent_order(target, first + start, count);
            parallel_for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
                Block& block = blocks[begin / kBlock];
                block.photons.reserve(2 * kBlock);
                Group group;
                for (std::size_t k = begin; k < end; k += kGroup) {
                    const auto part = std::span(order).subspan(k, std::min(kGroup, end - k));
                    group.indices.assign(part.begin(), part.end());
                    trace_both(target, group, block);
                }
            });
            // Grown by doubling, the list would be held twice: its size is foreseeable.
            if (start == 0) {
                double stored = 0;
                for (const Block& block : blocks) stored += double(block.photons.size());
                const double share =
                    static_cast<double>(target.count - count) / static_cast<double>(count);
                result.photons.reserve(result.photons.size() +
                                       static_cast<std::size_t>((1 + 1.02 * share) * stored) + 1);
            }
            for (const Block& block : blocks) {
                result.photons.insert(result.photons.end(), block.photons.begin(),
                                      block.photons.end());
                result.balance += block.balance;
            }
        }
        progress.update(static_cast<double>(++done) / static_cast<double>(targets.size()),
                        "photons");
    }
    return result;
}

}  // namespace vitrine
