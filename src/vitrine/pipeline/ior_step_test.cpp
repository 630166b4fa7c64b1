#include "pipeline/ior_step.h"

#include "base/error.h"
#include "base/file.h"
#include "perception/design.h"
#include "perception/observer_model.h"
#include "perception/scale_json.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace vitrine {
namespace {

std::string study_file(const std::string& name, double lambda, double power,
                       const std::vector<double>& stimuli) {
    const auto ior = equal_steps(1.4, 1.465, 10);
    std::vector<Observations> all;
    for (int o = 0; o < 8; ++o) {
        all.push_back({"o" + std::to_string(o),
                       simulate_answers({scale_with_threshold(ior, lambda, power), 0.0},
                                        all_quadruples(10), static_cast<std::uint64_t>(o))});
    }
    StudyOptions options;
    options.bootstrap.replicates = options.observer_replicates = 20;
    options.diagnostic_simulations = 10;
    const std::string path = (std::filesystem::temp_directory_path() / name).string();
    write_text_file(path, study_to_json(analyse_study(all, stimuli, options)));
    return path;
}

TEST(IorStep, ReadsANumber) {
    EXPECT_DOUBLE_EQ(read_ior_step("0.02").value, 0.02);
    EXPECT_THROW(read_ior_step("0"), InputError);
    EXPECT_THROW(read_ior_step("-0.01"), InputError);
    EXPECT_THROW(read_ior_step("2"), InputError);
    EXPECT_THROW(read_ior_step("nan"), InputError);
    EXPECT_THROW(read_ior_step("/nowhere/scale.json"), InputError);
}

TEST(IorStep, SamplesThePapersRangeInEightyOne) {
    const auto samples = ior_samples({}, 1.2, 2.0);
    ASSERT_EQ(samples.size(), 81u);
    EXPECT_DOUBLE_EQ(samples[1], 1.21);
    EXPECT_DOUBLE_EQ(samples.back(), 2.0);
}

TEST(IorStep, ReadsAStraightScaleAsOneNumber) {
    const auto step = read_ior_step(
        study_file("vitrine_straight_scale.json", 0.012, 1.0, equal_steps(1.4, 1.465, 10)));
    EXPECT_TRUE(step.local.empty());
    EXPECT_NEAR(step.value, 0.012, 0.0015);
}

TEST(IorStep, FollowsACurvedScale) {
    const auto step = read_ior_step(
        study_file("vitrine_curved_scale.json", 0.006, 2.0, equal_steps(1.4, 1.465, 10)));
    ASSERT_EQ(step.local.size(), 10u);
    EXPECT_GT(step.at(1.40), 1.5 * step.at(1.46));
    EXPECT_DOUBLE_EQ(step.at(1.2), step.local.front()[1]);
    EXPECT_DOUBLE_EQ(step.at(1.9), step.local.back()[1]);
    const auto samples = ior_samples(step, 1.40, 1.46);
    EXPECT_LT(samples.size(), ior_samples({.value = step.value, .local = {}}, 1.40, 1.46).size());
    for (std::size_t i = 1; i < samples.size(); ++i) EXPECT_GT(samples[i], samples[i - 1]);
}

TEST(IorStep, RefusesRanksAndPredictions) {
    EXPECT_THROW(read_ior_step(study_file("vitrine_rank_scale.json", 0.01, 1.0, {})), InputError);
    const auto path = std::filesystem::temp_directory_path() / "vitrine_prediction.json";
    write_text_file(path, R"({"schema": "vitrine.mlds_prediction/1"})");
    EXPECT_THROW(read_ior_step(path.string()), InputError);
}

}  // namespace
}  // namespace vitrine
