#include "render/pixel_samples.h"

#include <optional>

namespace vitrine {
namespace {

/// Below this albedo a surface shows nothing of the light on it.
constexpr float kLeastAlbedo = 1e-3f;

/// Samples whose mean is one value of a pixel's spread.
constexpr int kBlock = 2;

}  // namespace

void SoftSums::add(const PathResult& path, bool finds_soft) {
    if (!path.soft.is_present) return;
    ++seen;
    albedo += path.soft.albedo;
    position += path.soft.position;
    normal += path.soft.normal;
    if (!finds_soft) return;
    ++count;
    with += (path.soft.shadow + path.soft.diffuse) / path.soft.albedo.max(kLeastAlbedo);
    if (path.soft.hit_distance > 0) {
        ++hits;
        inverse_square += 1 / (path.soft.hit_distance * path.soft.hit_distance);
    }
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
    : scene_(scene), camera_(camera), origin_(camera.centre_in_world().cast<float>()), seed_(seed) {
    for (const CausticMaps& m : maps) {
        tracers_.emplace_back(scene, m.empty() ? nullptr : &m, paths, &translucent);
    }
}

void PixelSampler::add_samples(int x, int y, int target, int soft_target, int light_samples,
                               PixelSums& sums) const {
    // The camera rays of a pixel run side by side: what they meet is found together.
    constexpr int kTogether = 16;
    const int end = std::max(target, soft_target);
    std::array<std::optional<CameraSample>, kTogether> samples;
    std::array<Ray, kTogether> rays;
    std::array<Hit, kTogether> hits;
    while (sums.count < end) {
        const int first = sums.count, count = std::min(kTogether, end - first);
        for (int k = 0; k < count; ++k) {
            const auto slot = static_cast<std::size_t>(k);
            samples[slot] = camera_sample(camera_, seed_, x, y, first + k);
            rays[slot] = {origin_, samples[slot]->direction, 0.0f, 1e30f, kAllParts};
        }
        const auto some = static_cast<std::size_t>(count);
        scene_.closest(std::span<const Ray>(rays).first(some), std::span(hits).first(some));
        for (std::size_t k = 0; k < some; ++k) {
            const bool finds_soft = sums.soft_count < soft_target;
            add_sample(x, y, *samples[k], {finds_soft, finds_soft ? 1 : light_samples, &hits[k]},
                       sums);
            ++sums.count;
            sums.soft_count += finds_soft ? 1 : 0;
        }
    }
}

void PixelSampler::add_sample(int x, int y, const CameraSample& sample, const PathWish& wish,
                              PixelSums& sums) const {
    const auto& [sampler, direction] = sample;
    // Neighbours begin with different passes: soft light is averaged over them.
    const auto turn = static_cast<std::size_t>(sums.count + x + 2 * y);
    const PathTracer& tracer = tracers_[turn % tracers_.size()];
    const PathPair pair = tracer.trace_both(origin_, direction, sampler, wish);
    const PathResult &with = pair.with(), &without = pair.without();
    const bool is_covered = with.first_part >= 0 && scene_.is_virtual(with.first_part);
    const Rgb sharp = with.sharp();
    sums.with += sharp;
    sums.without += without.sharp();
    SoftSums& soft = is_covered ? sums.soft_virtual : sums.soft_real;
    const Rgb soft_with = with.soft.shadow + with.soft.diffuse;
    const Rgb soft_without = without.soft.shadow + without.soft.diffuse;
    soft.add(with, wish.finds_soft);
    if (wish.finds_soft && with.soft.is_present && pair.is_touched()) {
        if (!is_covered) {
            const Rgb scale = 1.0f / with.soft.albedo.max(kLeastAlbedo);
            soft.shadow += scale * (with.soft.shadow - without.soft.shadow);
            soft.diffuse += scale * (with.soft.diffuse - without.soft.diffuse);
        }
        if (without.soft.hit_distance > 0) {
            ++soft.hits;
            soft.inverse_square += 1 / (without.soft.hit_distance * without.soft.hit_distance);
        }
    }
    if (is_covered) {
        ++sums.covered;
        sums.object += sharp;
        sums.hidden += soft_without;
    } else if (pair.is_touched()) {
        for (std::size_t k = 0; k < kLayerCount; ++k) {
            sums.delta[k] += with.layers[k] - without.layers[k];
        }
    }
    const float change = luminance(Rgb(sharp - without.sharp()));
    sums.block += change;
    if ((sums.count + 1) % kBlock == 0) {
        sums.change += sums.block;
        sums.block_square += sums.block * sums.block;
        sums.block = 0;
    }
    if (!wish.finds_soft) return;
    const float soft_change = luminance(is_covered ? soft_with : Rgb(soft_with - soft_without));
    sums.soft_change += soft_change;
    sums.soft_change_square += soft_change * soft_change;
}

}  // namespace vitrine
