// render/estimation_columns.h: estimation mode for refractive indices: the light that one clear
// object throws on fixed places (pixels of any number of views), as one column per index, for a
// lamp of unit intensity.
//
// Only what the index changes is traced again: photons are kept at their entry into the object
// (`CausticBeam`), the places' share of every cell of space is worked out once (`ReceiverGrid`),
// and a column is linear in the lamp's intensity, so a whole fit of intensities, albedos and
// ambient light needs no more photons. Shadow and direct light at the same places:
// `direct_column`. Radiance seen = albedo / pi * (intensity * (direct + column) + the rest).
//
//     auto seen = caustic_receivers(scene, object, cameras, lamp, iors, opaque_mask);
//     auto grid = std::make_shared<const ReceiverGrid>(seen.points, 0.003);
//     CausticColumns columns(CausticBeam(scene, object, lamp, opaque_mask), grid);
//     std::vector<std::vector<Rgb>> e = columns.at(iors);  // e[n][receiver], W/m2 per W/sr
#pragma once

#include "geometry/camera.h"
#include "render/estimation_caustic.h"

#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

namespace vitrine {

/// Places that receive light, and the cells of space around them whose photons they count.
class ReceiverGrid {
  public:
    /// @param gather_radius_m of the kernel (Epanechnikov); cells are a third of it, and photons
    /// are
    ///   shared between the four nearest, so that what a place gets is continuous in their position
    /// Costs about 5 us and 0.5 kB per receiver.
    ReceiverGrid(std::span<const SurfacePoint> receivers, double gather_radius_m);

    /// Irradiance at each receiver of the photons that arrive. Photons on surfaces that face more
    /// than 73 degrees away from the receiver's do not count. Deterministic.
    /// Costs about 0.1 us per photon and receiver.
    std::vector<Rgb> gather(std::span<const BeamArrival> arrivals) const;

    std::size_t size() const { return start_.size() - 1; }

  private:
    struct Key {
        std::int32_t x, y, z, facing;
        bool operator==(const Key&) const = default;
    };
    struct KeyHash {
        std::size_t operator()(const Key& key) const;
    };
    struct Share {
        std::uint32_t cell;
        float weight;  // 1/m2
    };
    float cell_m_ = 0.001f;
    std::unordered_map<Key, std::uint32_t, KeyHash> cells_;
    std::vector<Share> shares_;
    std::vector<std::size_t> start_;  // first share of each receiver, and the end
};

/// One lamp and one object at fixed receivers.
class CausticColumns {
  public:
    CausticColumns(CausticBeam beam, std::shared_ptr<const ReceiverGrid> receivers)
        : beam_(std::move(beam)), receivers_(std::move(receivers)) {}

    /// Irradiance per W/sr at each receiver.
    std::vector<Rgb> at(double ior, const Rgb& sigma_a_per_m = Rgb::Zero()) const;
    /// The same for many indices, in parallel over them: `[index][receiver]`.
    std::vector<std::vector<Rgb>> at(std::span<const double> iors,
                                     const Rgb& sigma_a_per_m = Rgb::Zero()) const;

    const CausticBeam& beam() const { return beam_; }
    std::size_t receiver_count() const { return receivers_->size(); }

  private:
    CausticBeam beam_;
    std::shared_ptr<const ReceiverGrid> receivers_;
};

struct ViewReceivers {
    std::vector<SurfacePoint> points;  ///< on the scan, shading normals
    std::vector<int> camera, x, y;     ///< the pixel of each
};

struct ReceiverOptions {
    double min_share =
        0.05;                ///< of the unshadowed direct irradiance: fainter caustics are left out
    double margin_m = 0.01;  ///< around what is lit
    int pixel_step = 1;      ///< every so many pixels in x and y
};

/// The pixels of all views that look straight at the scan where `object` changes the light of the
/// lamp: its shadow and its caustic for any of `iors`.
/// Costs about 0.4 us per pixel and core, and 20 000 photons for each of up to five indices.
ViewReceivers caustic_receivers(const EstimationScene& scene, int object,
                                std::span<const Camera> cameras, const TrialLight& light,
                                std::span<const double> iors, std::uint32_t opaque_mask,
                                const ReceiverOptions& options = {});

}  // namespace vitrine
