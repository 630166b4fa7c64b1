#include "base/parallel.h"

#include "base/rng.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace vitrine {
namespace {

TEST(Parallel, SumIsBitIdenticalOverThreads) {
    const auto sum = [] {
        return parallel_sum(100000, 1000, 0.0f, [](std::size_t begin, std::size_t end) {
            Rng rng(stream_key(3, begin));
            float total = 0.0f;
            for (std::size_t i = begin; i < end; ++i) total += rng.next_float();
            return total;
        });
    };
    set_thread_count(1);
    const float one = sum();
    set_thread_count(8);
    EXPECT_EQ(one, sum());
    set_thread_count(0);
    EXPECT_NEAR(one, 50000.0f, 500.0f);
}

TEST(Parallel, RethrowsFromABody) {
    EXPECT_THROW(parallel_for(100, 7,
                              [](std::size_t i) {
                                  if (i == 42) throw std::runtime_error("42");
                              }),
                 std::runtime_error);
}

}  // namespace
}  // namespace vitrine
