#include "render/caustics.h"

#include "base/parallel.h"
#include "render/interface.h"
#include "render/sampler.h"
#include "render/small_stack.h"

namespace vitrine {
namespace {

/// Faint branches of an interface survive with this many times their share of the power.
constexpr float kFaintBranchBoost = 4.0f;
/// The share below which a branch is left to chance at all.
constexpr float kSurePower = 0.25f;
constexpr float kSoftRadiusFactor = 4.0f;
constexpr float kWideRadiusFactor = 8.0f;
constexpr float kBroadRadiusFactor = 32.0f;
constexpr float kNearFactor = 16.0f;
constexpr float kMergeShare = 0.3f;  // of the gather radius
/// Share of new photons that a progressive pass keeps: 2/3 shrinks noise and blur at equal rates.
constexpr double kProgressiveShare = 2.0 / 3.0;

struct Target {
    std::size_t light = 0;
    int part = 0;
    Sphere sphere;
    std::uint64_t count = 0;
    std::uint64_t key = 0;
};

float bending_weight(const Material& material) {
    if (std::holds_alternative<Dielectric>(material)) return 1.0f;
    if (const auto* mirror = std::get_if<Mirror>(&material)) {
        return mirror->reflectance.maxCoeff() > 0 ? 1.0f : 0.0f;
    }
    // A glossy lobe blurs: half the photons do.
    if (const auto* ward = std::get_if<Ward>(&material)) {
        return ward->rho_s.maxCoeff() > 0 ? 0.5f : 0.0f;
    }
    if (const auto* translucent = std::get_if<Translucent>(&material)) {
        return translucent->sigma > 0 ? 0.1f : 0.0f;  // its interface reflects 3 to 5 %
    }
    return 0.0f;
}

/// Sphere around the vertices: centre of the box, farthest vertex.
Sphere sphere_around(const Mesh& mesh) {
    Sphere sphere;
    sphere.centre = bounds(mesh).centre().cast<float>();
    for (const Vec3f& v : mesh.vertices) {
        sphere.radius = std::max(sphere.radius, (v - sphere.centre).norm());
    }
    sphere.radius *= 1.0001f;  // rays along the outline belong to it
    return sphere;
}

std::vector<Target> find_targets(const RenderScene& scene, const CausticOptions& options) {
    std::vector<Target> targets;
    std::vector<double> weights;
    double sum = 0;
    for (std::size_t light = 0; light < scene.lights().count(); ++light) {
        for (std::size_t p = 0; p < scene.scene().parts.size(); ++p) {
            const Part& part = scene.scene().parts[p];
            const float bending = bending_weight(part.material);
            if (bending <= 0 || part.mesh->empty()) continue;
            Target target{light, static_cast<int>(p), sphere_around(*part.mesh), 0,
                          stream_key(options.seed, light, p, 0xca05u)};
            // Power towards the part, by a few rays: shares photons among the lights fairly.
            double power = 0;
            constexpr std::uint32_t kPilotRays = 64;
            for (std::uint32_t i = 0; i < kPilotRays; ++i) {
                const PathSampler sampler(target.key ^ 1u, i);
                power += scene.lights()
                             .emit(light, target.sphere, sampler.pair(0, 0), sampler.pair(0, 1),
                                   scene.bounding_sphere())
                             .power.sum();
            }
            if (!(power > 0)) continue;
            weights.push_back(power * bending);
            sum += weights.back();
            targets.push_back(target);
        }
    }
    for (std::size_t i = 0; i < targets.size(); ++i) {
        targets[i].count = static_cast<std::uint64_t>(
            std::ceil(static_cast<double>(options.photon_count) * weights[i] / sum));
    }
    return targets;
}

/// One ray under way through smooth and glossy parts.
struct Flight {
    Vec3f origin, direction;
    Rgb power;
    Media media;
    int depth = 0;
    bool is_glossy = false;
    bool has_arrived = false;  ///< stored at a receiver before: later stores are no new power
};

class Tracer {
    using Pending = SmallStack<Flight, 48>;

  public:
    Tracer(const RenderScene& scene, const CausticOptions& options)
        : scene_(scene), options_(options) {}

    /// Follows the photon `index` of `target` among the parts of `view`; appends its arrivals.
    /// Returns true when the path met a virtual part.
    bool trace(const Target& target, std::uint64_t index, std::uint32_t view,
               std::vector<Photon>& arrivals, PhotonBalance& balance) const {
        const PathSampler sampler(target.key, static_cast<std::uint32_t>(index));
        const Vec2f on_light = scene_.lights().needs_position(target.light)
                                   ? sampler.further_pair(0)
                                   : Vec2f(0.5f, 0.5f);
        const EmittedRay emitted = scene_.lights().emit(
            target.light, target.sphere, sampler.pair(0, 0), on_light, scene_.bounding_sphere());
        ++balance.shot;
        if (!(emitted.power > 0).any()) return false;
        bool is_touched = false;
        Pending pending;
        Flight first;
        first.origin = emitted.origin;
        first.direction = emitted.direction;
        first.power = emitted.power / static_cast<float>(target.count);
        const float initial = first.power.maxCoeff();
        pending.push(first);
        while (!pending.empty()) {
            Flight flight = pending.pop();
            while (true) {
                Ray ray{flight.origin, flight.direction, 0.0f, 1e30f, view};
                const Hit hit = scene_.closest(ray);
                if (!hit.is_hit()) {
                    if (flight.depth > 0 && !flight.has_arrived) {
                        balance.escaped += flight.power.sum();
                    }
                    break;
                }
                is_touched |= scene_.is_virtual(hit.part);
                if (flight.depth == 0) {
                    if (hit.part != target.part) break;
                    ++balance.met;
                    balance.emitted += flight.power.sum();
                }
                if (flight.depth > options_.max_interfaces) {
                    if (!flight.has_arrived) balance.ended += flight.power.sum();
                    break;
                }
                if (!step(flight, hit, sampler, initial, pending, arrivals, view, balance)) {
                    break;
                }
            }
        }
        return is_touched;
    }

  private:
    void absorb(Flight& flight, const Rgb& factor, PhotonBalance& balance) const {
        const double before = flight.power.sum();
        flight.power *= factor;
        if (!flight.has_arrived) balance.absorbed += before - flight.power.sum();
    }

    /// One surface; false when the flight ends.
    bool step(Flight& flight, const Hit& hit, const PathSampler& sampler, float initial,
              Pending& pending, std::vector<Photon>& arrivals, std::uint32_t view,
              PhotonBalance& balance) const {
        const ShadingPoint point = scene_.surface(hit, flight.direction);
        absorb(flight, scene_.transmittance(flight.media, hit.distance), balance);
        const int depth = flight.depth++;
        if (scene_.dielectric(hit.part)) {
            return pass_interface(flight, point, depth, sampler, initial, pending, balance);
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
            arrivals.push_back(photon);
            if (!flight.has_arrived) balance.stored += flight.power.sum();
            flight.has_arrived = true;
        }
        if (!has_lobe) return false;
        return scatter(flight, point, bsdf, depth, sampler, initial, balance);
    }

    bool pass_interface(Flight& flight, const ShadingPoint& point, int depth,
                        const PathSampler& sampler, float initial, Pending& pending,
                        PhotonBalance& balance) const {
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
        const float chance = std::min(1.0f, kFaintBranchBoost * faint_power.maxCoeff() / initial);
        const bool stays = sampler.number(depth, 2) < chance && !pending.is_full();
        if (gamble(faint_power, flight.has_arrived, stays, chance, balance)) {
            Flight faint = flight;
            faint.power = faint_power;
            is_mostly_reflected ? refract_flight(faint) : reflect_flight(faint);
            pending.push(faint);
        }
        flight.power *= strong;
        is_mostly_reflected ? reflect_flight(flight) : refract_flight(flight);
        return survive(
            flight, [&] { return sampler.pair(depth, 2).y(); }, initial, balance);
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
    static bool survive(Flight& flight, const Draw& draw, float initial, PhotonBalance& balance) {
        const float survival = flight.power.maxCoeff() / (initial * kSurePower);
        return survival >= 1 ||
               gamble(flight.power, flight.has_arrived, draw() < survival, survival, balance);
    }

    bool scatter(Flight& flight, const ShadingPoint& point, const Bsdf& bsdf, int depth,
                 const PathSampler& sampler, float initial, PhotonBalance& balance) const {
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
            flight, [&] { return sampler.number(depth, 4); }, initial, balance);
    }

    const RenderScene& scene_;
    const CausticOptions& options_;
};

/// The photons [first, first + count) of a target, those sent in nearly the same direction one
/// after the other: rays that follow their neighbours find the hierarchy in the cache, which saves
/// a third of their time.
std::vector<std::uint64_t> coherent_order(const Target& target, std::uint64_t first,
                                          std::uint64_t count) {
    constexpr unsigned kBits = 6;  // per axis: as many cells as half a block has photons
    constexpr std::size_t kCells = std::size_t{1} << (2 * kBits);
    std::vector<std::uint16_t> cell(count);
    std::vector<std::uint32_t> start(kCells + 1, 0);
    for (std::uint64_t k = 0; k < count; ++k) {
        const Vec2f u = PathSampler(target.key, static_cast<std::uint32_t>(first + k)).pair(0, 0);
        const auto x = static_cast<unsigned>(u.x() * (1u << kBits));
        const auto y = static_cast<unsigned>(u.y() * (1u << kBits));
        unsigned code = 0;  // bits interleaved (Morton 1966)
        for (unsigned bit = 0; bit < kBits; ++bit) {
            code |= (x >> bit & 1u) << (2 * bit) | (y >> bit & 1u) << (2 * bit + 1);
        }
        cell[k] = static_cast<std::uint16_t>(code);
        ++start[code + 1];
    }
    for (std::size_t c = 0; c < kCells; ++c) start[c + 1] += start[c];
    std::vector<std::uint64_t> order(count);
    for (std::uint64_t k = 0; k < count; ++k) order[start[cell[k]]++] = first + k;
    return order;
}

}  // namespace

double progressive_radius(double first_m, int pass) {
    double area = first_m * first_m;
    for (int k = 1; k <= pass; ++k) area *= (k + kProgressiveShare) / (k + 1);
    return std::sqrt(area);
}

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
    constexpr std::uint64_t kChunk = 64 * kBlock;
    struct Block {
        std::vector<Photon> photons;
        PhotonBalance balance;
    };
    const auto trace_both = [&](const Target& target, std::uint64_t index, Block& block) {
        const std::size_t old_size = block.photons.size();
        const bool is_touched =
            tracer.trace(target, index, kAllParts, block.photons, block.balance);
        if (!has_virtual || !is_touched) return;
        for (std::size_t k = old_size; k < block.photons.size(); ++k) {
            block.photons[k].views = kVirtualParts;
        }
        if (scene.is_virtual(target.part)) return;
        PhotonBalance ignored;
        tracer.trace(target, index, kRealParts, block.photons, ignored);
    };
    const std::vector<Target> targets = find_targets(scene, options);
    std::size_t done = 0;
    for (const Target& target : targets) {
        const std::uint64_t first = target.count * static_cast<std::uint64_t>(options.pass);
        const std::size_t size_before = result.photons.size();
        // A chunk at a time: photons wait in their blocks beside the list for its share alone.
        for (std::uint64_t start = 0; start < target.count; start += kChunk) {
            const std::uint64_t count = std::min<std::uint64_t>(kChunk, target.count - start);
            std::vector<Block> blocks((count + kBlock - 1) / kBlock);
            parallel_for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
                Block& block = blocks[begin / kBlock];
                block.photons.reserve(2 * kBlock);
                for (const std::uint64_t index :
                     coherent_order(target, first + start + begin, end - begin)) {
                    trace_both(target, index, block);
                }
            });
            for (const Block& block : blocks) {
                result.photons.insert(result.photons.end(), block.photons.begin(),
                                      block.photons.end());
                result.balance += block.balance;
            }
            // Grown by doubling, the list would be held twice: its size is foreseeable.
            if (start == 0) {
                const double share =
                    static_cast<double>(target.count - count) / static_cast<double>(count);
                const auto stored = static_cast<double>(result.photons.size() - size_before);
                result.photons.reserve(result.photons.size() +
                                       static_cast<std::size_t>(1.02 * share * stored));
            }
        }
        progress.update(static_cast<double>(++done) / static_cast<double>(targets.size()),
                        "photons");
    }
    return result;
}

CausticMaps build_caustic_maps(const std::vector<Photon>& photons, double gather_radius_m) {
    const auto radius = static_cast<float>(gather_radius_m);
    CausticMaps maps;
    const float soft_radius = kSoftRadiusFactor * radius, wide_radius = kWideRadiusFactor * radius;
    std::vector<Photon> sharp = merge_photons(photons, kMergeShare * radius, PhotonChoice::Sharp);
    const std::vector<Photon> soft =
        merge_photons(photons, kMergeShare * soft_radius, PhotonChoice::Soft);
    maps.sharp = PhotonGrid(sharp, radius);
    maps.soft = PhotonGrid(soft, soft_radius);
    sharp.insert(sharp.end(), soft.begin(), soft.end());
    for (Photon& photon : sharp) photon.keeps_direction = false;
    const std::vector<Photon> merged = merge_photons(sharp, kMergeShare * wide_radius);
    maps.wide = PhotonGrid(merged, wide_radius);
    const float broad_radius = kBroadRadiusFactor * radius;
    maps.broad = PhotonGrid(merge_photons(merged, kMergeShare * broad_radius), broad_radius);
    std::vector<double> weights;
    for (const Photon& photon : merged) {
        const Rgb flux = photon.power * photon.diffuse_albedo();
        if (!(flux > 0).any()) continue;
        maps.secondary.push_back({photon.position, photon.normal.unpack(), flux, photon.views});
        weights.push_back(luminance(flux));
    }
    if (!weights.empty()) maps.secondary_choice = GuidedChoice(weights);
    maps.near_m = kNearFactor * radius;
    return maps;
}

}  // namespace vitrine
