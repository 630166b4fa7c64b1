// render/estimation_caustic.h: light that a clear object throws on the scan, for trial indices.
#pragma once

#include "render/estimation_irradiance.h"
#include "render/estimation_refraction.h"

#include <span>
#include <vector>

namespace vitrine {

struct CausticBeamOptions {
    int photon_count = 100'000;  ///< aimed at the object's bounding sphere, which a ball fills
    int max_exits = 1;      ///< ways out followed per photon: the first carries over 90 %, the next
                            ///< are reflected inside before; each costs as much as the first
    bool is_shell = false;  ///< thin-walled: straight through
    double wall_m = 0.0025;  ///< of a shell
    bool has_fresnel =
        true;  ///< false: neither loss nor reflection at the surfaces, as in the paper
};

/// A photon that arrived on the scan.
struct BeamArrival {
    Vec3f position = Vec3f::Zero();
    Vec3f direction = Vec3f::Zero();  ///< of travel
    Vec3f normal = Vec3f::Zero();     ///< of the scan, against `direction`
    Rgb power = Rgb::Zero();          ///< W per W/sr of the lamp; zero: lost on the way
};

/// The photons of one lamp that meet one object first, kept at the place where they enter it: up
/// to there nothing depends on the index, so a trial traces only what lies behind.
///
/// Photons start on the disc, quasi-random inside the cone around the object's bounding sphere,
/// with the same unit-square points for every lamp and index (common random numbers: what is
/// computed from them is smooth in both). Fresnel losses and absorption along the way are kept.
class CausticBeam {
  public:
    /// @param opaque_mask parts that block the way from the lamp to the object
    /// Costs about 0.6 us per photon and core.
    CausticBeam(const EstimationScene& scene, int object, const TrialLight& light,
                std::uint32_t opaque_mask, const CausticBeamOptions& options = {});

    /// In a fixed order: for each photon that met the object, what it reflects straight away and
    /// `max_exits` ways through it.
    /// Costs about 0.7 us per photon, exit and core.
    std::vector<BeamArrival> arrivals(double ior, const Rgb& sigma_a_per_m = Rgb::Zero()) const;

    std::size_t met_count() const { return entries_.size(); }
    const EstimationScene& scene() const { return scene_; }

  private:
    struct Entry {
        ObjectEntry entry;
        BeamArrival mirrored;  // of what is reflected at the entry, if all of it were
        Vec3f source = Vec3f::Zero();
        float power = 0.0f;  // W per W/sr
    };
    std::optional<Entry> shoot(std::uint64_t index, std::uint32_t opaque_mask) const;
    BeamArrival reflect_at(const ObjectEntry& entry) const;
    BeamArrival arrive(const Entry& entry, float ior, const Rgb& sigma_a, int skipped_exits) const;

    EstimationScene scene_;
    int object_ = 0;
    TrialLight light_;
    CausticBeamOptions options_;
    Vec3f target_ = Vec3f::Zero();  // bounding sphere of the object
    float target_radius_ = 0.0f;
    std::vector<Entry> entries_;  // in photon order
};

struct TrialCaustic {
    double ior = 1.5;
    Rgb sigma_a_per_m = Rgb::Zero();
    bool is_shell = false;   ///< thin-walled: straight through
    double wall_m = 0.0025;  ///< of a shell
    int photon_count = 100'000;
    double gather_radius_m = 0.004;  ///< kernel radius; about two pixels seen from a metre
};

/// Irradiance at `points` per W/sr of `light` that came through `object`, once. For many indices
/// at the same places see `render/estimation_columns.h`.
/// Costs about 1.5 us per photon and core.
std::vector<Rgb> caustic_irradiance(const EstimationScene& scene, int object,
                                    const TrialLight& light, std::span<const SurfacePoint> points,
                                    std::uint32_t opaque_mask, const TrialCaustic& options);

}  // namespace vitrine
