#include "render/photon_grid.h"

#include "base/rng.h"

#include <algorithm>

namespace vitrine {
namespace {

/// To the nearest of 65535 steps of [-1, 1].
std::int16_t to_steps(float v) {
    const float scaled = std::clamp(v, -1.0f, 1.0f) * 32767.0f;
    return static_cast<std::int16_t>(scaled < 0 ? scaled - 0.5f : scaled + 0.5f);
}

float sign_not_zero(float v) { return v < 0 ? -1.0f : 1.0f; }

}  // namespace

PackedDirection::PackedDirection(const Vec3f& unit) {
    Vec2f p = unit.head<2>() / unit.cwiseAbs().sum();
    if (unit.z() < 0) {
        p = Vec2f((1 - std::abs(p.y())) * sign_not_zero(p.x()),
                  (1 - std::abs(p.x())) * sign_not_zero(p.y()));
    }
    x = to_steps(p.x());
    y = to_steps(p.y());
}

Vec3f PackedDirection::along() const {
    Vec3f v(static_cast<float>(x) / 32767.0f, static_cast<float>(y) / 32767.0f, 0);
    v.z() = 1 - std::abs(v.x()) - std::abs(v.y());
    if (v.z() < 0) {
        const float old_x = v.x();
        v.x() = (1 - std::abs(v.y())) * sign_not_zero(old_x);
        v.y() = (1 - std::abs(old_x)) * sign_not_zero(v.y());
    }
    return v;
}

PhotonGrid::PhotonGrid(const std::vector<Photon>& photons, float radius_m)
    : radius_(radius_m), inverse_cell_(0.5f / radius_m) {
    std::uint32_t buckets = 8;
    while (buckets < photons.size() && buckets < (1u << 24)) buckets *= 2;
    bucket_mask_ = buckets - 1;
    start_.assign(std::size_t{buckets} + 1, 0);
    const auto bucket_at = [&](const Photon& photon) {
        const Vec3f scaled = photon.position * inverse_cell_;
        return bucket_of(scaled.array().floor().cast<int>());
    };
    for (const Photon& photon : photons) ++start_[bucket_at(photon) + 1];
    for (std::size_t b = 0; b < buckets; ++b) start_[b + 1] += start_[b];
    photons_.resize(photons.size());
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    for (const Photon& photon : photons) photons_[next[bucket_at(photon)]++] = photon;
    occupied_.assign((buckets >> 9) + 1, 0);
    for (std::uint32_t b = 0; b < buckets; ++b) {
        if (start_[b] < start_[b + 1]) occupied_[b >> 9] |= std::uint64_t{1} << (b >> 3 & 63u);
    }
}

namespace {

/// Cell, facing (dominant axis of the normal and its sign) and views of a photon.
struct MergeKey {
    int x = 0, y = 0, z = 0, kind = 0;
    bool operator==(const MergeKey&) const = default;
    std::size_t hash() const {
        const auto pair = [](int a, int b) {
            return std::uint64_t{static_cast<std::uint32_t>(a)} << 32 |
                   static_cast<std::uint32_t>(b);
        };
        return static_cast<std::size_t>(mix_bits(pair(x, y) ^ mix_bits(pair(z, kind))));
    }
};

/// Numbers of keys. Open addressing with linear steps: half the time of std::unordered_map here; a
/// slot holds a number alone, since half of the slots stay free.
class MergeTable {
  public:
    /// Number of the key; of a new one, how many there were before.
    std::uint32_t find(const MergeKey& key) {
        if (2 * (keys_.size() + 1) > slots_.size()) grow();
        std::uint32_t& slot = slot_of(key);
        if (slot == kFree) slot = add(key);
        return slot;
    }
    /// A number that no key finds.
    std::uint32_t add_apart() { return add({}); }

  private:
    static constexpr std::uint32_t kFree = 0xffffffffu;

    std::uint32_t add(const MergeKey& key) {
        keys_.push_back(key);
        return static_cast<std::uint32_t>(keys_.size() - 1);
    }
    std::uint32_t& slot_of(const MergeKey& key) {
        const std::size_t mask = slots_.size() - 1;
        std::size_t i = key.hash() & mask;
        while (slots_[i] != kFree && !(keys_[slots_[i]] == key)) i = (i + 1) & mask;
        return slots_[i];
    }
    void grow() {
        std::size_t size = 1024;
        while (size < 3 * keys_.size()) size *= 2;
        std::vector<std::uint32_t> old(size, kFree);
        old.swap(slots_);
        for (const std::uint32_t number : old) {
            if (number != kFree) slot_of(keys_[number]) = number;
        }
    }

    std::vector<std::uint32_t> slots_;
    std::vector<MergeKey> keys_;
};

}  // namespace

std::vector<Photon> merge_photons(const std::vector<Photon>& photons, float cell_m,
                                  PhotonChoice choice) {
    std::vector<Photon> merged;
    std::vector<Rgb> albedo;  // weighted by power
    MergeTable table;
    const float inverse_cell = 1.0f / cell_m;
    for (const Photon& photon : photons) {
        if (choice == PhotonChoice::Sharp && photon.is_glossy) continue;
        if (choice == PhotonChoice::Soft && !photon.is_glossy) continue;
        std::uint32_t i = 0;
        if (photon.keeps_direction) {
            i = table.add_apart();
        } else {
            const Eigen::Vector3i cell =
                (photon.position * inverse_cell).array().floor().cast<int>();
            const Vec3f n = photon.normal.unpack();
            int axis = 0;
            n.cwiseAbs().maxCoeff(&axis);
            const int kind = (2 * axis + (n[axis] < 0 ? 1 : 0)) * 4 + photon.views;
            i = table.find({cell.x(), cell.y(), cell.z(), kind});
        }
        const float power = photon.power.sum();
        if (i == merged.size()) {
            merged.push_back(photon);
            albedo.push_back(power * photon.diffuse_albedo());
            continue;
        }
        Photon& sum = merged[i];
        sum.power += photon.power;
        albedo[i] += power * photon.diffuse_albedo();
        // The mean place so far, so that no other sum need be kept.
        const float total = sum.power.sum();
        if (total > 0) sum.position += power / total * (photon.position - sum.position);
    }
    for (std::size_t i = 0; i < merged.size(); ++i) {
        const float total = merged[i].power.sum();
        if (total > 0) merged[i].set_diffuse_albedo(albedo[i] / total);
    }
    return merged;
}

}  // namespace vitrine
