// base/parallel.h: loops over all cores that give the same bits on any number of them.
//
// Work is cut into blocks whose borders depend on `count` and `grain` alone. Write results by
// index; sum per block and add the blocks in order (`parallel_sum`): never an atomic float.
#pragma once

#include "base/progress.h"

#include <cstddef>
#include <functional>
#include <vector>

namespace vitrine {

/// Limits the threads used from now on; 0 means all cores.
void set_thread_count(int count);
int thread_count();

/// Calls `body(begin, end)` for consecutive blocks of at most `grain` items of [0, count).
/// An exception in a body is rethrown here.
void parallel_for_blocks(std::size_t count, std::size_t grain,
                         const std::function<void(std::size_t begin, std::size_t end)>& body);

/// As above for long work. After blocks of the calling thread's own it reports the share of all
/// that are done; no thread waits for another before the end.
/// @throws Cancelled when the callback asked to stop.
void parallel_for_blocks(std::size_t count, std::size_t grain, const Progress& progress,
                         std::string_view what,
                         const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Calls `body(i)` for each i of [0, count), in blocks of `grain`.
template <typename Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body) {
    parallel_for_blocks(count, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) body(i);
    });
}

/// Sums `block(begin, end)` over the blocks in index order: bit-identical for any thread count.
template <typename T, typename Block>
T parallel_sum(std::size_t count, std::size_t grain, const T& zero, const Block& block) {
    const std::size_t block_count = (count + grain - 1) / grain;
    std::vector<T> partial(block_count, zero);
    parallel_for_blocks(count, grain, [&](std::size_t begin, std::size_t end) {
        partial[begin / grain] = block(begin, end);
    });
    T total = zero;
    for (const T& value : partial) total += value;
    return total;
}

}  // namespace vitrine
