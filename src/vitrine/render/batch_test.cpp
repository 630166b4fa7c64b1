#include "render/batch.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(Batch, HoldsWhatWasAddedThroughEveryGrowth) {
    Batch<int> batch;
    for (int round = 0; round < 10; ++round) {
        batch.make_room(7);
        for (int i = 0; i < 7; ++i) batch.add(7 * round + i);
    }
    ASSERT_EQ(batch.size(), 70u);
    for (std::size_t i = 0; i < batch.size(); ++i) EXPECT_EQ(batch[i], static_cast<int>(i));
}

TEST(Batch, TakesWhatWasStoredBehindIt) {
    Batch<int> batch;
    batch.make_room(1);
    batch.add(1);
    batch.make_room(3);
    int* end = batch.end();
    *end++ = 2;
    *end++ = 3;
    batch.take(end);
    EXPECT_EQ(batch.size(), 3u);
    EXPECT_EQ(batch.items().back(), 3);
    Batch<int> other;
    other.swap(batch);
    EXPECT_EQ(batch.size(), 0u);
    EXPECT_EQ(other[0] + other[1] + other[2], 6);
    other.clear();
    EXPECT_EQ(other.size(), 0u);
    EXPECT_TRUE(other.begin() == other.end());
}

}  // namespace
}  // namespace vitrine
