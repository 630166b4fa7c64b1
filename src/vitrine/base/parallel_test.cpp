#include "base/parallel.h"

#include "base/error.h"
#include "base/pool.h"
#include "base/rng.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <thread>

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

TEST(Parallel, ReportsFromTheCallerAndStopsWhenAsked) {
    const auto caller = std::this_thread::get_id();
    double last = 0;
    bool is_from_caller = true, is_rising = true;
    const Progress report([&](double fraction, std::string_view what) {
        is_from_caller &= std::this_thread::get_id() == caller;
        is_rising &= fraction > last && fraction <= 1 && what == "rows";
        last = fraction;
        return true;
    });
    std::vector<int> seen(1003, 0);
    parallel_for_blocks(seen.size(), 10, report, "rows", [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++seen[i];
    });
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 1003);
    EXPECT_TRUE(is_from_caller && is_rising);
    EXPECT_GT(last, 0);

    const Progress stop([](double, std::string_view) { return false; });
    EXPECT_THROW(parallel_for_blocks(1000, 1, stop, "rows", [](std::size_t, std::size_t) {}),
                 Cancelled);
}

TEST(Pool, LendsToOneAtATimeAndKeeps) {
    Pool<int> pool;
    int made = 0;
    const auto make = [&] { return std::make_unique<int>(++made); };
    {
        const auto first = pool.lend(make);
        const auto second = pool.lend(make);
        EXPECT_EQ(*first, 1);
        EXPECT_EQ(*second, 2);
        *second = 20;
    }
    const auto again = pool.lend(make);
    const auto other = pool.lend(make);
    EXPECT_EQ(*again + *other, 21);
    EXPECT_EQ(made, 2);
}

TEST(Pool, IsSafeFromAllThreads) {
    Pool<int> pool;
    parallel_for(1000, 1, [&](std::size_t) {
        const auto count = pool.lend([] { return std::make_unique<int>(0); });
        ++*count;
    });
    int sum = 0;
    std::vector<Pool<int>::Loan> loans;
    for (int i = 0; i < 64; ++i) {
        loans.push_back(pool.lend([] { return std::make_unique<int>(0); }));
        sum += *loans.back();
    }
    EXPECT_EQ(sum, 1000);
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
