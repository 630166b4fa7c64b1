// render/photon_tracer.h: photons on their way through smooth and glossy parts, a group at a time.
#pragma once

#include "render/caustics.h"
#include "render/glass_lanes.h"
#include "render/medium_table.h"
#include "render/photon_emission.h"
#include "render/sampler.h"

#include <span>
#include <vector>

namespace vitrine {

/// Where the photons of a thread arrive, and memory for their flights.
class PhotonGroup {
  public:
    explicit PhotonGroup(const RenderScene& scene) : media_(scene) {}

    std::vector<std::uint32_t> indices;    ///< of the photons to trace, by slot
    std::vector<std::uint8_t> is_touched;  ///< per slot: met a virtual part
    std::vector<Photon> arrivals;          ///< those of this trace behind the ones before
    std::vector<std::uint32_t> slots;      ///< whose arrival each of this trace is
    PhotonBalance balance;                 ///< of all traces

  private:
    friend class PhotonTracer;

    /// What a ray under way carries.
    struct Flight {
        Rgb power = Rgb::Zero();
        float initial = 0;       // power of the photon at first, of its strongest channel
        std::uint32_t slot = 0;  // of the photon in its group
        std::uint32_t medium = 0;
        bool is_glossy = false;
        bool has_arrived = false;  // stored at a receiver before: later stores are no new power
    };

    struct Flights {
        std::vector<Flight> carried;
        std::vector<RayAndHit> rays;  // apart, as they are asked for together

        void clear() {
            carried.clear();
            rays.clear();
        }
        void append(const Flights& others) {
            carried.insert(carried.end(), others.carried.begin(), others.carried.end());
            rays.insert(rays.end(), others.rays.begin(), others.rays.end());
        }
    };

    Flights flights_, next_, faint_;
    std::vector<std::uint32_t> glass_, plain_, others_;  // numbers of the flights that met such
    MediumTable media_;
    EmittedLanes emitted_ = {};
    PlainLanes surfaces_ = {};
    GlassLanes glass_lanes_ = {};
};

/// Photons of a group go on by one surface at a time: neighbours take much the same way, and are
/// traced together.
class PhotonTracer {
  public:
    PhotonTracer(const RenderScene& scene, const CausticOptions& options);

    /// Follows the photons `group.indices` of `target` among the parts of `view`; adds arrivals.
    void trace(const PhotonTarget& target, std::uint32_t view, PhotonGroup& group) const;

  private:
    using Flight = PhotonGroup::Flight;
    /// What is asked of a part at every hit.
    enum class Surface : std::uint8_t { Glass, Plain, Other };
    struct Receiver {
        Surface surface = Surface::Other;
        bool is_virtual = false;
        Photon photon;  // what all that arrive there share
    };

    void emit(const PhotonTarget& target, std::uint32_t view, PhotonGroup& group) const;
    void sort_out(const PhotonTarget& target, int depth, PhotonGroup& group) const;
    void find_surfaces(std::span<const std::uint32_t> numbers, PhotonGroup& group) const;
    void pass_glass(const PhotonTarget& target, int depth, std::uint32_t view,
                    std::span<const std::uint32_t> numbers, PhotonGroup& group) const;
    void store_plain(std::uint32_t view, std::span<const std::uint32_t> numbers,
                     PhotonGroup& group) const;
    static void finish(Photon& photon, const Flight& flight, std::uint32_t view,
                       PhotonGroup& group);
    bool step(Flight& flight, Ray& ray, const Hit& hit, const PhotonTarget& target, int depth,
              std::uint32_t view, PhotonGroup& group) const;
    bool scatter(Flight& flight, Ray& ray, const ShadingPoint& point, const Bsdf& bsdf, int depth,
                 const PathSampler& sampler, PhotonBalance& balance) const;

    const RenderScene& scene_;
    const CausticOptions& options_;
    std::vector<Receiver> receivers_;  // per part
};

}  // namespace vitrine
