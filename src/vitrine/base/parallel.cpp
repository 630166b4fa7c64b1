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

namespace {

using Body = std::function<void(std::size_t, std::size_t)>;

std::size_t block_count_of(std::size_t count, std::size_t grain) {
    VITRINE_CHECK_GT(grain, std::size_t{0});
    return (count + grain - 1) / grain;
}

template <typename Partitioner>
void run_blocks(std::size_t count, std::size_t grain, const Body& body,
                const Partitioner& partitioner) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, block_count_of(count, grain), 1),
        [&](const tbb::blocked_range<std::size_t>& blocks) {
            for (std::size_t b = blocks.begin(); b != blocks.end(); ++b) {
                body(b * grain, std::min(count, (b + 1) * grain));
            }
        },
        partitioner);
}

}  // namespace

void parallel_for_blocks(std::size_t count, std::size_t grain, const Body& body) {
    run_blocks(count, grain, body, tbb::auto_partitioner());
}

void parallel_for_blocks(std::size_t count, std::size_t grain, const Progress& progress,
                         std::string_view what, const Body& body) {
    const auto block_count = static_cast<double>(block_count_of(count, grain));
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<std::size_t> done = 0;
    const auto body_and_report = [&](std::size_t begin, std::size_t end) {
        body(begin, end);
        const std::size_t so_far = ++done;
        if (std::this_thread::get_id() != caller) return;
        progress.update(static_cast<double>(so_far) / block_count, what);
    };
    // Blocks take long: each is worth a task of its own, so that the last ones are shared out.
    run_blocks(count, grain, body_and_report, tbb::simple_partitioner());
}

}  // namespace vitrine
