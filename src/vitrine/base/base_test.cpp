#include "base/error.h"
#include "base/file.h"
#include "base/progress.h"
#include "base/rng.h"
#include "base/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <vector>

namespace vitrine {
namespace {

TEST(Error, CheckPrintsBothValues) {
    try {
        VITRINE_CHECK_LT(3, 2);
        FAIL();
    } catch (const InternalError& error) {
        EXPECT_NE(std::string(error.what()).find("3 vs 2"), std::string::npos);
    }
}

TEST(Rng, UniformMomentsAndKeyedStreams) {
    Rng rng(stream_key(1, 2, 3));
    double sum = 0, squares = 0;
    const int count = 200000;
    for (int i = 0; i < count; ++i) {
        const double u = rng.next_double();
        ASSERT_GE(u, 0.0);
        ASSERT_LT(u, 1.0);
        sum += u;
        squares += u * u;
    }
    EXPECT_NEAR(sum / count, 0.5, 4 / std::sqrt(12.0 * count));
    EXPECT_NEAR(squares / count, 1.0 / 3.0, 0.003);
    EXPECT_NE(Rng(stream_key(1, 2)).next_u32(), Rng(stream_key(2, 1)).next_u32());
    EXPECT_EQ(Rng(7).next_u32(), Rng(7).next_u32());
}

TEST(Progress, PartsMapToTheWholeAndFalseCancels) {
    std::vector<double> seen;
    const Progress progress([&](double fraction, std::string_view) {
        seen.push_back(fraction);
        return fraction < 0.7;
    });
    progress.part(0.5, 1.0).update(0.2);
    EXPECT_DOUBLE_EQ(seen.back(), 0.6);
    EXPECT_THROW(progress.update(0.9), Cancelled);
}

TEST(File, AtomicWriteKeepsTheOldFileWhenTheWriterFails) {
    const auto path = std::filesystem::temp_directory_path() / "vitrine_base_test" / "a.txt";
    write_text_file(path, "old");
    EXPECT_THROW(write_file_atomically(path,
                                       [](const std::filesystem::path& temporary) {
                                           std::ofstream(temporary) << "half";
                                           throw MachineError("disk full");
                                       }),
                 MachineError);
    EXPECT_EQ(read_text_file(path), "old");
    int files = 0;
    for ([[maybe_unused]] const auto& entry :
         std::filesystem::directory_iterator(path.parent_path())) {
        ++files;
    }
    EXPECT_EQ(files, 1);
    EXPECT_THROW(read_text_file(path.parent_path() / "missing"), InputError);
    std::filesystem::remove_all(path.parent_path());
}

TEST(Text, NearestNameAndNumbers) {
    const std::vector<std::string> names = {"photon_count", "seed", "threads"};
    EXPECT_EQ(nearest_name("photon_cuont", names), "photon_count");
    EXPECT_EQ(nearest_name("zzzzzzzzzz", names), "");
    double value = 0;
    EXPECT_TRUE(parse_double("1.5e-3", value));
    EXPECT_EQ(value, 1.5e-3);
    EXPECT_FALSE(parse_double("1,5", value));
}

}  // namespace
}  // namespace vitrine
