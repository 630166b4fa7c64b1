#include "render/caustics.h"

#include "base/parallel.h"
#include "render/photon_tracer.h"

#include <span>

namespace vitrine {

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
    const PhotonTracer tracer(scene, options);
    const bool has_virtual = scene.has_virtual();
    constexpr std::uint64_t kBlock = 8192;
    constexpr std::size_t kGroup = 1024;  // fits the nearer caches
    constexpr std::uint64_t kChunk = 64 * kBlock;
    struct Block {
        std::vector<Photon> photons;
        PhotonBalance balance;
    };
    // In the scene with virtual parts, and where these are met in the one without.
    const auto trace_both = [&](const PhotonTarget& target, PhotonGroup& group) {
        const std::size_t first_arrival = group.arrivals.size();
        tracer.trace(target, kAllParts, group);
        if (!has_virtual) return;
        for (std::size_t k = 0; k < group.slots.size(); ++k) {
            if (!group.is_touched[group.slots[k]]) continue;
            group.arrivals[first_arrival + k].views = kVirtualParts;
        }
        if (scene.is_virtual(target.part)) return;
        std::size_t touched = 0;
        for (std::size_t slot = 0; slot < group.indices.size(); ++slot) {
            if (group.is_touched[slot]) group.indices[touched++] = group.indices[slot];
        }
        group.indices.resize(touched);
        const PhotonBalance balance = group.balance;
        tracer.trace(target, kRealParts, group);
        group.balance = balance;
    };
    const std::vector<PhotonTarget> targets = find_targets(scene, options);
    std::size_t done = 0;
    for (const PhotonTarget& target : targets) {
        const std::uint64_t first = target.count * static_cast<std::uint64_t>(options.pass);
        // A chunk at a time: photons wait in their blocks beside the list for its share alone.
        for (std::uint64_t start = 0; start < target.count; start += kChunk) {
            const std::uint64_t count = std::min<std::uint64_t>(kChunk, target.count - start);
            std::vector<Block> blocks((count + kBlock - 1) / kBlock);
            const std::vector<std::uint32_t> order = coherent_order(target, first + start, count);
            parallel_for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
                Block& block = blocks[begin / kBlock];
                PhotonGroup group(scene);
                group.arrivals.reserve(2 * kBlock);
                for (std::size_t k = begin; k < end; k += kGroup) {
                    const auto part = std::span(order).subspan(k, std::min(kGroup, end - k));
                    group.indices.assign(part.begin(), part.end());
                    trace_both(target, group);
                }
                block = {std::move(group.arrivals), group.balance};
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
