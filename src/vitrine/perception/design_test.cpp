#include "perception/design.h"

#include "base/error.h"
#include "perception/observer_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace vitrine {
namespace {

std::vector<PlannedTrial> of_kind(const std::vector<PlannedTrial>& all, TrialKind kind) {
    std::vector<PlannedTrial> out;
    for (const auto& t : all) {
        if (t.kind == kind) out.push_back(t);
    }
    return out;
}

TEST(Design, TenStimuliGive210QuadruplesAndElevenGive330) {
    EXPECT_EQ(all_quadruples(10).size(), 210u);
    EXPECT_EQ(all_quadruples(11).size(), 330u);
    EXPECT_EQ(make_design({.stimulus_count = 10}).size(), 210u);
    EXPECT_EQ(make_design({.stimulus_count = 11}).size(), 330u);
}

TEST(Design, AsksEveryQuadrupleOnceInRandomOrder) {
    const auto design = make_design({.stimulus_count = 8, .seed = 5});
    std::set<Quadruple> asked;
    for (const auto& t : design) asked.insert(t.rank);
    EXPECT_EQ(asked.size(), all_quadruples(8).size());
    std::vector<Quadruple> order;
    for (const auto& t : design) order.push_back(t.rank);
    EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
}

TEST(Design, IsTheSameForTheSameSeedAndAnotherForAnother) {
    const auto text = [](std::uint64_t seed) { return design_to_csv(make_design({.seed = seed})); };
    EXPECT_EQ(text(3), text(3));
    EXPECT_NE(text(3), text(4));
}

TEST(Design, BalancesTopAndSidesToOneTrial) {
    for (const std::uint64_t seed : {1, 2, 3}) {
        int top = 0, first = 0, second = 0;
        const auto design = make_design({.seed = seed});
        for (const auto& t : design) {
            top += t.is_first_pair_top;
            first += t.is_first_mirrored;
            second += t.is_second_mirrored;
        }
        EXPECT_EQ(top, 105);
        EXPECT_EQ(first, 105);
        EXPECT_EQ(second, 105);
    }
}

TEST(Design, SubsetUsesEveryStimulusNearlyEquallyOften) {
    for (const int wanted : {20, 53, 100}) {
        const auto subset = balanced_subset(12, wanted, 7);
        std::map<int, int> used;
        for (const Quadruple& q : subset) {
            for (const int r : q) ++used[r];
        }
        EXPECT_EQ(std::set<Quadruple>(subset.begin(), subset.end()).size(), subset.size());
        ASSERT_EQ(used.size(), 12u);
        int least = 1000, most = 0;
        for (const auto& [rank, count] : used) {
            least = std::min(least, count);
            most = std::max(most, count);
        }
        EXPECT_LE(most - least, 1) << wanted;
    }
}

TEST(Design, PutsPracticeFirstAndNoTwoCatchTrialsInARow) {
    const auto design =
        make_design({.stimulus_count = 7, .practice_count = 4, .catch_count = 17, .seed = 11});
    ASSERT_EQ(design.size(), 35u + 4 + 17);
    for (std::size_t i = 0; i < design.size(); ++i) {
        EXPECT_EQ(design[i].kind == TrialKind::Practice, i < 4);
        if (i > 4) {
            EXPECT_FALSE(design[i].kind == TrialKind::Catch &&
                         design[i - 1].kind == TrialKind::Catch);
        }
    }
    EXPECT_EQ(of_kind(design, TrialKind::Catch).size(), 17u);
}

TEST(Design, CatchTrialsHaveOneNarrowAndOneWidePair) {
    for (const auto& t : of_kind(make_design({.catch_count = 6}), TrialKind::Catch)) {
        const int first = t.rank[1] - t.rank[0], second = t.rank[3] - t.rank[2];
        EXPECT_EQ(std::min(first, second), 1);
        EXPECT_EQ(std::max(first, second), 7);
    }
}

TEST(Design, ScreenOrderAndAnswerFollowTheLayout) {
    PlannedTrial t{.rank = {1, 4, 6, 9}};
    EXPECT_EQ(screen_order(t), (Quadruple{1, 4, 6, 9}));
    EXPECT_EQ(response_of(t, true), 0);
    EXPECT_EQ(response_of(t, false), 1);
    t.is_first_pair_top = false;
    t.is_second_mirrored = true;
    EXPECT_EQ(screen_order(t), (Quadruple{9, 6, 1, 4}));
    EXPECT_EQ(response_of(t, true), 1);
    EXPECT_EQ(response_of(t, false), 0);
}

TEST(Design, RefusesWhatCannotBeAsked) {
    EXPECT_THROW(make_design({.stimulus_count = 3}), InputError);
    EXPECT_THROW(make_design({.stimulus_count = 41}), InputError);
    EXPECT_THROW(make_design({.stimulus_count = 5, .trial_count = 6}), InputError);
    EXPECT_THROW(make_design({.repeats = 0}), InputError);
    EXPECT_THROW(make_design({.stimulus_count = 5, .catch_count = 50}), InputError);
}

TEST(Trials, RoundTripThroughCsv) {
    const std::vector<Trial> trials = {{1, {1, 2, 3, 4}}, {0, {2, 5, 7, 10}}};
    const auto read = parse_trials_csv(trials_to_csv(trials), "t.csv");
    ASSERT_EQ(read.size(), 1u);
    ASSERT_EQ(read[0].trials.size(), 2u);
    EXPECT_EQ(read[0].observer, "t.csv");
    EXPECT_EQ(read[0].trials[1].rank, trials[1].rank);
    EXPECT_EQ(read[0].trials[0].response, 1);
}

TEST(Trials, ReadsWhatRWritesAndSplitsParticipants) {
    const std::string text =
        "\"\",\"resp\",\"S1\",\"S2\",\"S3\",\"S4\",\"participant\",\"kind\"\r\n"
        "\"1\",1,1,2,3,4,\"ann\",\"main\"\r\n\"2\",0,1,2,3,5,\"bob\",\"main\"\r\n"
        "\"3\",0,1,2,3,5,\"bob\",\"catch\"\r\n";
    const auto read = parse_trials_csv(text, "t.csv");
    ASSERT_EQ(read.size(), 2u);
    EXPECT_EQ(read[0].observer, "ann");
    EXPECT_EQ(read[1].trials.size(), 1u);
    // The pair (3, 5) of the catch trial has more between it, and bob chose the other.
    EXPECT_EQ(read[0].catch_count, 0);
    EXPECT_EQ(read[1].catch_count, 1);
    EXPECT_EQ(read[1].catch_failed, 1);
}

TEST(Trials, PracticeIsNeverAnalysed) {
    const std::string header = "kind,resp,S1,S2,S3,S4\n";
    const auto read =
        parse_trials_csv(header + "practice,0,1,2,3,5\nmain,1,1,2,3,4\ncatch,1,1,2,3,5\n", "t.csv");
    ASSERT_EQ(read.size(), 1u);
    EXPECT_EQ(read[0].trials.size(), 1u);
    EXPECT_EQ(read[0].catch_failed, 0);
    EXPECT_THROW(parse_trials_csv(header + "practice,0,1,2,3,5\n", "t.csv"), InputError);
}

TEST(Trials, SaysWhereTheTextIsWrong) {
    const auto where = [](const std::string& text) -> std::string {
        try {
            parse_trials_csv(text, "t.csv");
        } catch (const InputError& e) {
            return e.parts().where;
        }
        return "accepted";
    };
    EXPECT_EQ(where(""), "t.csv");
    EXPECT_EQ(where("resp,S1,S2,S3\n1,1,2,3\n"), "t.csv:1");
    EXPECT_EQ(where("resp,S1,S2,S3,S4,S5\n"), "t.csv:1");
    EXPECT_EQ(where("resp,S1,S2,S3,S4\n1,1,2,3,4\n2,1,2,3,4\n"), "t.csv:3");
    EXPECT_EQ(where("resp,S1,S2,S3,S4\n1,0,2,3,4\n"), "t.csv:2");
    EXPECT_EQ(where("resp,S1,S2,S3,S4\n1,1.5,2,3,4\n"), "t.csv:2");
    EXPECT_EQ(where("resp,S1,S2,S3,S4\n1,2,2,3,4\n"), "t.csv:2");
    EXPECT_EQ(where("resp,S1,S2,S3,S4\n1,1,2,3\n"), "t.csv:2");
    EXPECT_EQ(where("kind,resp,S1,S2,S3,S4\nmian,1,1,2,3,4\n"), "t.csv:2");
    EXPECT_EQ(where("resp,S1,S2,S3,S4\n1,1,2,3,99999999999\n"), "t.csv:2");
}

TEST(Trials, CanonicalFormTurnsTheAnswerWithTheQuestion) {
    EXPECT_EQ(canonical({1, {6, 9, 1, 4}}).rank, (Quadruple{1, 4, 6, 9}));
    EXPECT_EQ(canonical({1, {6, 9, 1, 4}}).response, 0);
    EXPECT_EQ(canonical({1, {4, 1, 9, 6}}).rank, (Quadruple{1, 4, 6, 9}));
    EXPECT_EQ(canonical({1, {4, 1, 9, 6}}).response, 1);
}

TEST(Observer, AnswersAsOftenAsItsProbability) {
    const SimulatedObserver observer{{0, 1, 2, 4}, 0.1};
    const Quadruple q = {1, 2, 3, 4};  // eta = (4 - 2) - (1 - 0) = 1
    EXPECT_DOUBLE_EQ(decision_variable(observer.beta, q), 1.0);
    const double p = probability_of_one(1.0, 0.1);
    EXPECT_NEAR(p, 0.05 + 0.9 * 0.841344746, 1e-8);
    const std::vector<Quadruple> many(40000, q);
    int ones = 0;
    for (const Trial& t : simulate_answers(observer, many, 1)) ones += t.response;
    EXPECT_NEAR(ones / 40000.0, p, 4 * std::sqrt(p * (1 - p) / 40000));
}

TEST(Observer, LogarithmsHoldFarIntoTheTails) {
    for (const double eta : {-38.0, -9.0, -6.0, -5.999, -1.0, 0.0, 2.0, 7.0, 38.0}) {
        const auto a = answer_probability(eta);
        ASSERT_TRUE(std::isfinite(a.log_p) && std::isfinite(a.log_q)) << eta;
        const double step = 1e-5;
        const double slope_p =
            (answer_probability(eta + step).log_p - answer_probability(eta - step).log_p) /
            (2 * step);
        const double slope_q =
            (answer_probability(eta + step).log_q - answer_probability(eta - step).log_q) /
            (2 * step);
        EXPECT_NEAR(a.score_p, slope_p, 1e-5 * std::max(1.0, a.score_p)) << eta;
        EXPECT_NEAR(a.score_q, -slope_q, 1e-5 * std::max(1.0, a.score_q)) << eta;
    }
    // The two formulas meet at the border between them.
    EXPECT_NEAR(answer_probability(-5.9999999).log_p, answer_probability(-6.0000001).log_p, 2e-6);
    EXPECT_NEAR(answer_probability(-10).log_p, -53.23128515051247, 1e-12);
}

TEST(Observer, ScaleWithThresholdHasThatThreshold) {
    const std::vector<double> n = {1.4, 1.42, 1.44, 1.46};
    const auto straight = scale_with_threshold(n, 0.01);
    EXPECT_NEAR(straight.back(), 0.5 * 0.06 / 0.01, 1e-12);
    const auto curved = scale_with_threshold(n, 0.01, 2.0);
    // Slope at the far end 0.5 / lambda: height = span * 0.5 / lambda / power.
    EXPECT_NEAR(curved.back(), 0.5 * 0.06 / 0.01 / 2, 1e-12);
}

}  // namespace
}  // namespace vitrine
