#include "render/pixel_samples.h"

namespace vitrine {
namespace {

/// Below this albedo a surface shows nothing of the light on it.
constexpr float kLeastAlbedo = 1e-3f;

/// Samples whose mean is one value of a pixel's spread.
constexpr int kBlock = 2;

}  // namespace

void SoftSums::add(const PathResult& path, bool finds_soft) {
    const SoftLight* soft = path.soft();
    if (!soft) return;
    ++seen;
    albedo += soft->albedo;
    position += soft->position;
    normal += soft->normal;
    if (!finds_soft) return;
    ++count;
    with += (soft->shadow + soft->diffuse) / soft->albedo.max(kLeastAlbedo);
    add_hit(soft->hit_distance);
}

void SoftSums::add_hit(float distance) {
    if (distance <= 0) return;
    ++hits;
    inverse_square += 1 / (distance * distance);
}

SoftPixel SoftSums::mean() const {
    SoftPixel pixel;
    if (seen == 0) return pixel;
    pixel.position = position / static_cast<float>(seen);
    pixel.normal = normal.normalized();
    if (count == 0) return pixel;
    const auto n = static_cast<float>(count);
    pixel.value = {with / n, shadow / n, diffuse / n, 1 / n, n};
    pixel.inverse_square_sum = inverse_square;
    pixel.hits = hits;
    return pixel;
}

float variance_of_mean(float sum, float square_sum, int count) {
    if (count < 2) return 0;
    const float mean = sum / static_cast<float>(count);
    return std::max(0.0f, square_sum / static_cast<float>(count) - mean * mean) /
           static_cast<float>(count - 1);
}

float PixelSums::sharp_variance() const {
    const int blocks = count / kBlock;
    return variance_of_mean(change, block_square, blocks) / float(kBlock * kBlock);
}

PixelSampler::PixelSampler(const RenderScene& scene, const std::vector<CausticMaps>& maps,
                           const TranslucentLight& translucent, const Camera& camera,
                           const PathOptions& paths, std::uint64_t seed)
    : rays_(camera), seed_(seed) {
    for (const CausticMaps& m : maps) {
        tracers_.emplace_back(scene, m.empty() ? nullptr : &m, paths, &translucent);
    }
}

void PixelSampler::add_samples(int y, const Image<int>& target, const Image<int>& soft_target,
                               int light_samples, Image<PixelSums>& sums) const {
    const auto use = [&](int x, const PathWish& wish, const PathPair& pair) {
        add(pair, wish, sums(x, y));
    };
    const auto group = groups_.lend([&] { return std::make_unique<PathGroup>(tracers_, rays_); });
    PathRow row(*group, y, use);
    for (int x = 0; x < sums.width(); ++x) {
        const PixelSums& pixel = sums(x, y);
        const PathSampler sampler(stream_key(seed_, unsigned(x), unsigned(y)), 0);
        int soft_left = soft_target(x, y) - pixel.soft_count;
        const int end = std::max(target(x, y), soft_target(x, y));
        for (int k = pixel.count; k < end; ++k) {
            // Neighbours begin with different passes: soft light is averaged over them.
            const auto turn = static_cast<std::size_t>(k + x + 2 * y);
            const bool finds_soft = soft_left-- > 0;
            row.add(turn % tracers_.size(), x, sampler.at(static_cast<std::uint32_t>(k)),
                    {finds_soft, finds_soft ? 1 : light_samples});
        }
    }
    row.finish();
}

void PixelSampler::add(const PathPair& pair, const PathWish& wish, PixelSums& sums) const {
    const PathResult &with = pair.with(), &without = pair.without();
    const bool is_covered = with.sees_virtual();
    const Rgb sharp = with.sharp();
    sums.with += sharp;
    sums.without += without.sharp();
    SoftSums& soft = is_covered ? sums.soft_virtual : sums.soft_real;
    const Rgb soft_with = with.soft_sum(), soft_without = without.soft_sum();
    soft.add(with, wish.finds_soft);
    const SoftLight *here = with.soft(), *there = without.soft();
    if (wish.finds_soft && here && there && pair.is_touched()) {
        if (!is_covered) {
            const Rgb scale = 1.0f / here->albedo.max(kLeastAlbedo);
            soft.shadow += scale * (here->shadow - there->shadow);
            soft.diffuse += scale * (here->diffuse - there->diffuse);
        }
        soft.add_hit(there->hit_distance);
    }
    if (is_covered) {
        ++sums.covered;
        sums.object += sharp;
        sums.hidden += soft_without;
    } else if (pair.is_touched()) {
        for (std::size_t k = 0; k < kLayerCount; ++k) {
            sums.delta[k] += with.layer(k) - without.layer(k);
        }
    }
    const float change = luminance(Rgb(sharp - without.sharp()));
    sums.block += change;
    if ((sums.count + 1) % kBlock == 0) {
        sums.change += sums.block;
        sums.block_square += sums.block * sums.block;
        sums.block = 0;
    }
    ++sums.count;
    if (!wish.finds_soft) return;
    ++sums.soft_count;
    const float soft_change = luminance(is_covered ? soft_with : Rgb(soft_with - soft_without));
    sums.soft_change += soft_change;
    sums.soft_change_square += soft_change * soft_change;
}

}  // namespace vitrine
