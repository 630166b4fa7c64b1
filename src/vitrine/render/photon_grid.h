// render/photon_grid.h: photons on surfaces and a hash grid that finds those near a point.
#pragma once

#include "math/vector.h"

#include <array>
#include <cstdint>
#include <vector>

namespace vitrine {

/// A unit vector in 32 bits (octahedral map, Cigolle et al. 2014); error below 0.005 degrees.
struct PackedDirection {
    std::int16_t x = 0, y = 0;
    PackedDirection() = default;
    explicit PackedDirection(const Vec3f& unit);
    /// A vector of its direction, of any length.
    Vec3f along() const;
    Vec3f unpack() const { return along().normalized(); }
};

/// Whether the angle between `along`, of any length, and the unit vector is one of at least
/// `min_cos` > 0.
inline bool is_within(const Vec3f& along, const Vec3f& unit, float min_cos) {
    const float d = along.dot(unit);
    return d > 0 && d * d >= min_cos * min_cos * along.squaredNorm();
}

/// 36 bytes.
struct Photon {
    Vec3f position = Vec3f::Zero();
    Rgb power = Rgb::Zero();                  ///< W
    PackedDirection to_light;                 ///< where it came from, away from the surface
    PackedDirection normal;                   ///< geometric, on the side it arrived
    std::array<std::uint8_t, 3> albedo = {};  ///< diffuse, of the receiver, in 1/255
    std::uint8_t views : 2 = 3;  ///< scenes in which it arrives: kRealParts | kVirtualParts bits
    bool is_glossy : 1 = false;  ///< bent by a glossy lobe somewhere: its pattern is soft
    bool keeps_direction : 1 = false;  ///< the receiver is not Lambertian
    std::uint8_t spare : 4 = 0;        ///< so that equal photons are equal byte by byte

    Rgb diffuse_albedo() const { return Rgb(albedo[0], albedo[1], albedo[2]) / 255.0f; }
    void set_diffuse_albedo(const Rgb& value) {
        for (std::size_t c = 0; c < 3; ++c) {
            const float code = 255.0f * value[static_cast<int>(c)] + 0.5f;
            albedo[c] = static_cast<std::uint8_t>(code < 255.0f ? code : 255.0f);
        }
    }
};

static_assert(sizeof(Photon) == 36);

/// Photons sorted into cells of twice the gather radius. Building is linear in the count; memory is
/// 36 bytes per photon and 4 to 8 per cell; a query visits 8 cells, those that hold any.
class PhotonGrid {
  public:
    PhotonGrid() = default;
    PhotonGrid(const std::vector<Photon>& photons, float radius_m);

    bool empty() const { return photons_.empty(); }
    std::size_t size() const { return photons_.size(); }
    float radius() const { return radius_; }
    const std::vector<Photon>& photons() const { return photons_; }

    /// Calls `visit(photon, kernel)` for each photon within the radius of `position` on a surface
    /// that faces like `normal`. The kernel (Epanechnikov, 1/m2) integrates to one over a plane:
    /// irradiance is the sum of kernel * power.
    template <typename Visit>
    void gather(const Vec3f& position, const Vec3f& normal, const Visit& visit) const {
        if (photons_.empty()) return;
        const Vec3f scaled = position * inverse_cell_ - Vec3f::Constant(0.5f);
        const Eigen::Vector3i low = scaled.array().floor().cast<int>();
        const float radius2 = radius_ * radius_;
        const float scale = 2.0f / (kPif * radius2);
        // The look-ups wait for memory, not for each other: all buckets first, then all photons.
        std::uint32_t bucket[8], begin[8], end[8];
        int bucket_count = 0, count = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const std::uint32_t b =
                bucket_of(low + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2));
            // Most places are dark, which a table small enough for the nearest cache says.
            if (!(occupied_[b >> 9] >> (b >> 3 & 63u) & 1u)) continue;
            bucket[bucket_count++] = b;
        }
        for (int corner = 0; corner < bucket_count; ++corner) {
            bool is_repeated = false;  // two cells in one bucket must not count twice
            for (int k = 0; k < corner; ++k) is_repeated |= bucket[k] == bucket[corner];
            const std::uint32_t first = start_[bucket[corner]], last = start_[bucket[corner] + 1];
            if (first == last || is_repeated) continue;
            __builtin_prefetch(&photons_[first]);
            begin[count] = first;
            end[count++] = last;
        }
        for (int k = 0; k < count; ++k) {
            for (std::uint32_t i = begin[k]; i < end[k]; ++i) {
                const Photon& photon = photons_[i];
                const Vec3f d = photon.position - position;
                const float distance2 = d.squaredNorm();
                if (distance2 >= radius2) continue;
                // Same sheet: near the tangent plane and facing alike.
                if (std::abs(d.dot(normal)) > kMaxHeight * radius_) continue;
                if (!is_within(photon.normal.along(), normal, kMinNormalCos)) continue;
                visit(photon, scale * (1.0f - distance2 / radius2));
            }
        }
    }

  private:
    static constexpr float kMaxHeight = 0.5f;     // of the radius: tolerates curved receivers
    static constexpr float kMinNormalCos = 0.5f;  // 60 degrees: across an edge is another face

    /// Blocks of 2 x 2 x 2 cells lie side by side in memory: a query touches three on average.
    std::uint32_t bucket_of(const Eigen::Vector3i& cell) const {
        const std::uint32_t hash = static_cast<std::uint32_t>(cell.x() >> 1) * 73856093u ^
                                   static_cast<std::uint32_t>(cell.y() >> 1) * 19349663u ^
                                   static_cast<std::uint32_t>(cell.z() >> 1) * 83492791u;
        const auto corner =
            static_cast<std::uint32_t>((cell.x() & 1) | (cell.y() & 1) << 1 | (cell.z() & 1) << 2);
        return ((hash ^ hash >> 15) << 3 | corner) & bucket_mask_;
    }

    std::vector<Photon> photons_;          // sorted by bucket, input order within
    std::vector<std::uint32_t> start_;     // first photon of each bucket, and the end
    std::vector<std::uint64_t> occupied_;  // a bit per block of 8 buckets: it holds photons
    std::uint32_t bucket_mask_ = 0;
    float radius_ = 0.0f;
    float inverse_cell_ = 0.0f;
};

enum class PhotonChoice {
    All,
    Sharp,  ///< never bent by a glossy lobe
    Soft,   ///< the others
};

/// Sums photons that share a cell of `cell_m`, a facing and the views they belong to, into one at
/// their mean place. What a gather of radius >= 3 cells finds changes by about 1 %; the cost of a
/// gather no longer grows with the photon count. Photons that keep their direction stay apart.
/// @param choice those that are looked at
std::vector<Photon> merge_photons(const std::vector<Photon>& photons, float cell_m,
                                  PhotonChoice choice = PhotonChoice::All);

}  // namespace vitrine
