#include "render/photon_grid.h"

#include "base/rng.h"

#include <algorithm>
#include <unordered_map>

namespace vitrine {
namespace {

float sign_not_zero(float v) { return v < 0 ? -1.0f : 1.0f; }

}  // namespace

PackedDirection::PackedDirection(const Vec3f& unit) {
    Vec2f p = unit.head<2>() / unit.cwiseAbs().sum();
    if (unit.z() < 0) {
        p = Vec2f((1 - std::abs(p.y())) * sign_not_zero(p.x()),
                  (1 - std::abs(p.x())) * sign_not_zero(p.y()));
    }
    x = static_cast<std::int16_t>(std::lround(std::clamp(p.x(), -1.0f, 1.0f) * 32767.0f));
    y = static_cast<std::int16_t>(std::lround(std::clamp(p.y(), -1.0f, 1.0f) * 32767.0f));
}

Vec3f PackedDirection::unpack() const {
    Vec3f v(static_cast<float>(x) / 32767.0f, static_cast<float>(y) / 32767.0f, 0);
    v.z() = 1 - std::abs(v.x()) - std::abs(v.y());
    if (v.z() < 0) {
        const float old_x = v.x();
        v.x() = (1 - std::abs(v.y())) * sign_not_zero(old_x);
        v.y() = (1 - std::abs(old_x)) * sign_not_zero(v.y());
    }
    return v.normalized();
}

PhotonGrid::PhotonGrid(const std::vector<Photon>& photons, float radius_m)
    : radius_(radius_m), inverse_cell_(0.5f / radius_m) {
    std::uint32_t buckets = 1;
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
}

std::vector<Photon> merge_photons(const std::vector<Photon>& photons, float cell_m) {
    struct Key {
        int x, y, z;
        int kind;  // facing and views
        bool operator==(const Key&) const = default;
    };
    struct KeyHash {
        std::size_t operator()(const Key& k) const {
            const auto part = [](int a, int b) {
                return std::uint64_t{static_cast<std::uint32_t>(a)} << 32 |
                       static_cast<std::uint32_t>(b);
            };
            return static_cast<std::size_t>(mix_bits(part(k.x, k.y) ^ mix_bits(part(k.z, k.kind))));
        }
    };
    std::vector<Photon> merged;
    std::vector<Vec3> moment;  // position weighted by power
    std::vector<Rgb> albedo;
    std::vector<double> weight;
    std::unordered_map<Key, std::uint32_t, KeyHash> index;
    index.reserve(photons.size() / 4 + 16);
    for (const Photon& photon : photons) {
        const double w = std::max(1e-30f, photon.power.sum());
        if (photon.keeps_direction) {
            merged.push_back(photon);
            moment.push_back(photon.position.cast<double>() * w);
            albedo.push_back(photon.diffuse_albedo() * static_cast<float>(w));
            weight.push_back(w);
            continue;
        }
        const Eigen::Vector3i cell = (photon.position / cell_m).array().floor().cast<int>();
        const Vec3f n = photon.normal.unpack();
        // Facing: the dominant axis and its sign.
        int axis = 0;
        n.cwiseAbs().maxCoeff(&axis);
        const int kind = (2 * axis + (n[axis] < 0 ? 1 : 0)) * 4 + photon.views;
        const auto [found, is_new] = index.try_emplace(Key{cell.x(), cell.y(), cell.z(), kind},
                                                       static_cast<std::uint32_t>(merged.size()));
        if (is_new) {
            merged.push_back(photon);
            moment.push_back(photon.position.cast<double>() * w);
            albedo.push_back(photon.diffuse_albedo() * static_cast<float>(w));
            weight.push_back(w);
        } else {
            const std::uint32_t i = found->second;
            merged[i].power += photon.power;
            moment[i] += photon.position.cast<double>() * w;
            albedo[i] += photon.diffuse_albedo() * static_cast<float>(w);
            weight[i] += w;
        }
    }
    for (std::size_t i = 0; i < merged.size(); ++i) {
        merged[i].position = (moment[i] / weight[i]).cast<float>();
        merged[i].set_diffuse_albedo(albedo[i] / static_cast<float>(weight[i]));
    }
    return merged;
}

}  // namespace vitrine
