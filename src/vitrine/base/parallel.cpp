#include "base/parallel.h"

#include "base/error.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <memory>
#include <thread>

namespace vitrine {
namespace {

std::unique_ptr<tbb::global_control>& limit() {
    static std::unique_ptr<tbb::global_control> control;
    return control;
}

int& wanted() {
    static int count = 0;
    return count;
}

}  // namespace

void set_thread_count(int count) {
    VITRINE_CHECK_GE(count, 0);
    wanted() = count;
    limit().reset();
    if (count > 0) {
        limit() = std::make_unique<tbb::global_control>(
            tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(count));
    }
}

int thread_count() {
    return wanted() > 0 ? wanted() : static_cast<int>(std::thread::hardware_concurrency());
}

void parallel_for_blocks(std::size_t count, std::size_t grain,
                         const std::function<void(std::size_t, std::size_t)>& body) {
    VITRINE_CHECK_GT(grain, std::size_t{0});
    const std::size_t block_count = (count + grain - 1) / grain;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, block_count, 1),
                      [&](const tbb::blocked_range<std::size_t>& blocks) {
                          for (std::size_t b = blocks.begin(); b != blocks.end(); ++b) {
                              body(b * grain, std::min(count, (b + 1) * grain));
                          }
                      });
}

void parallel_for_blocks(std::size_t count, std::size_t grain, const Progress& progress,
                         std::string_view what,
                         const std::function<void(std::size_t, std::size_t)>& body) {
    VITRINE_CHECK_GT(grain, std::size_t{0});
    const std::size_t block_count = (count + grain - 1) / grain;
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<std::size_t> done = 0;
    // Blocks take long: each is worth a task of its own, so that the last ones are shared out.
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, block_count, 1),
        [&](const tbb::blocked_range<std::size_t>& blocks) {
            for (std::size_t b = blocks.begin(); b != blocks.end(); ++b) {
                body(b * grain, std::min(count, (b + 1) * grain));
                const std::size_t so_far = ++done;
                if (std::this_thread::get_id() != caller) continue;
                progress.update(static_cast<double>(so_far) / static_cast<double>(block_count),
                                what);
            }
        },
        tbb::simple_partitioner());
}

}  // namespace vitrine
