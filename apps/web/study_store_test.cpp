#include "study_store.h"

#include "base/error.h"
#include "base/file.h"
#include "perception/trial.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace vitrine::web {
namespace {
namespace fs = std::filesystem;

class Store : public testing::Test {
  protected:
    void SetUp() override {
        folder = fs::temp_directory_path() /
                 (std::string("vitrine_study_") +
                  testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::remove_all(folder);
    }
    void TearDown() override { fs::remove_all(folder); }
    std::string log(const std::string& id) {
        return read_text_file(folder / "participants" / id / "log.csv");
    }
    fs::path folder;
    DesignOptions design{5, 0, 1, 1, 1, 3};
};

TEST(ParticipantId, IsAPlainWord) {
    for (const char* good : {"a", "P07", "ann-2_b", "0"}) EXPECT_TRUE(is_participant_id(good));
    for (const char* bad : {"", "..", ".", "-a", "a/b", "a b", "a\n", "\xc3\xa4", "../x",
                            "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"}) {
        EXPECT_FALSE(is_participant_id(bad)) << bad;
    }
}

TEST_F(Store, RunsASessionToItsEnd) {
    StudyStore store(folder, design);
    SessionState state = store.open("ann");
    ASSERT_EQ(state.total, 5 + 1 + 1);
    while (!state.is_done()) {
        state = store.answer("ann", {state.next, state.next % 2 == 0, "ArrowUp", 500.25, 300});
    }
    const auto from_log = parse_trials_csv(log("ann"), "log");
    const auto from_trials =
        parse_trials_csv(read_text_file(folder / "participants/ann/trials.csv"), "trials");
    ASSERT_EQ(from_log.size(), 1u);
    EXPECT_EQ(from_log[0].observer, "ann");
    ASSERT_EQ(from_log[0].trials.size(), 5u);
    ASSERT_EQ(from_trials[0].trials.size(), 5u);
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(from_log[0].trials[i].rank, from_trials[0].trials[i].rank);
        EXPECT_EQ(from_log[0].trials[i].response, from_trials[0].trials[i].response);
    }
}

TEST_F(Store, GoesOnWhereAnEarlierProcessStopped) {
    SessionState before;
    {
        StudyStore store(folder, design);
        store.give_consent("bob");
        store.calibrate("bob", {3.8, 550, 1});
        for (int i = 0; i < 3; ++i) store.answer("bob", {i, true, "ArrowUp", 400, 300});
        before = store.open("bob");
    }
    design.trial_count = 3;  // options of a later start do not change a session that runs
    StudyStore store(folder, design);
    const SessionState state = store.open("bob");
    EXPECT_EQ(state.next, 3);
    EXPECT_EQ(state.total, before.total);
    EXPECT_TRUE(state.has_consented);
    EXPECT_EQ(state.calibration.px_per_mm, 3.8);
    EXPECT_EQ(state.trial.rank, before.trial.rank);
}

TEST_F(Store, DropsAnUnfinishedLineAndKeepsAllBefore) {
    {
        StudyStore store(folder, design);
        for (int i = 0; i < 3; ++i) store.answer("cy", {i, false, "ArrowDown", 400, 300});
    }
    const std::string whole = log("cy");
    std::ofstream(folder / "participants/cy/log.csv", std::ios::app) << "cy,4,main,1,1,2";
    StudyStore store(folder, design);
    EXPECT_EQ(store.open("cy").next, 3);
    EXPECT_EQ(log("cy"), whole);
}

TEST_F(Store, RefusesALogOfAnotherDesign) {
    {
        StudyStore store(folder, design);
        store.answer("di", {0, true, "x", 400, 300});
    }
    std::ofstream(folder / "participants/di/log.csv", std::ios::app)
        << "di,2,main,1,1,9,3,4,1,9,3,4,top,x,1,1,t,1\n";
    StudyStore store(folder, design);
    EXPECT_THROW(store.open("di"), InputError);
}

TEST_F(Store, TakesEachAnswerOnce) {
    StudyStore store(folder, design);
    store.answer("eve", {0, true, "ArrowUp", 400, 300});
    const std::string once = log("eve");
    EXPECT_EQ(store.answer("eve", {0, false, "ArrowUp", 400, 300}).next, 1);
    EXPECT_EQ(store.answer("eve", {5, false, "ArrowUp", 400, 300}).next, 1);
    EXPECT_EQ(log("eve"), once);
}

TEST_F(Store, KeepsManyParticipantsApart) {
    StudyStore store(folder, design);
    std::vector<std::thread> people;
    for (int p = 0; p < 4; ++p) {
        people.emplace_back([&store, p] {
            const std::string id = "p" + std::to_string(p);
            SessionState state = store.open(id);
            while (!state.is_done()) state = store.answer(id, {state.next, p % 2 == 0, "k", 1, 1});
        });
    }
    for (std::thread& t : people) t.join();
    for (int p = 0; p < 4; ++p) {
        EXPECT_EQ(parse_trials_csv(log("p" + std::to_string(p)), "l")[0].trials.size(), 5u);
    }
    EXPECT_NE(log("p0").substr(log("p0").find('\n') + 4),
              log("p1").substr(log("p1").find('\n') + 4));
}

TEST_F(Store, FollowsNoLink) {
    StudyStore store(folder, design);
    const fs::path elsewhere = folder / "elsewhere";
    fs::create_directories(elsewhere);
    fs::create_directories(folder / "participants");
    fs::create_directory_symlink(elsewhere, folder / "participants" / "mallory");
    EXPECT_THROW(store.open("mallory"), MachineError);
    EXPECT_TRUE(fs::is_empty(elsewhere));
    fs::create_directories(folder / "participants" / "trudy");
    std::ofstream(elsewhere / "target") << "secret";
    fs::create_symlink(elsewhere / "target", folder / "participants" / "trudy" / "log.csv");
    EXPECT_THROW(store.open("trudy"), MachineError);
}

TEST_F(Store, WritesNoCommaOrQuoteOfAPage) {
    StudyStore store(folder, design);
    store.answer("gil", {0, true, "a,\"b\n=c", 1, 1});
    EXPECT_NE(log("gil").find(",abc,"), std::string::npos);
}

TEST_F(Store, RefusesASecondServerAndNamesTheFirst) {
    StudyStore store(folder, design);
    const pid_t child = ::fork();
    if (child == 0) {
        int code = 1;
        try {
            StudyStore second(folder, design);
        } catch (const MachineError& e) {
            const bool names =
                std::string(e.what()).find(std::to_string(::getppid())) != std::string::npos;
            code = names ? 0 : 2;
        }
        ::_exit(code);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Store, SurvivesKillAtAnyMomentWithoutLosingAConfirmedAnswer) {
    int pipe_ends[2];
    ASSERT_EQ(::pipe(pipe_ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
        StudyStore store(folder, {10, 0, 1, 0, 0, 1});
        SessionState state = store.open("hal");
        while (!state.is_done()) {
            state = store.answer("hal", {state.next, true, "k", 1, 1});
            const char confirmed = 'x';
            if (::write(pipe_ends[1], &confirmed, 1) != 1) ::_exit(1);
        }
        ::_exit(0);
    }
    ::close(pipe_ends[1]);
    int confirmed = 0;
    char byte;
    while (confirmed < 37 && ::read(pipe_ends[0], &byte, 1) == 1) ++confirmed;
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    while (::read(pipe_ends[0], &byte, 1) == 1) ++confirmed;
    ::close(pipe_ends[0]);
    StudyStore store(folder, {10, 0, 1, 0, 0, 1});
    const int next = store.open("hal").next;
    EXPECT_GE(next, confirmed);
    EXPECT_LE(next, confirmed + 1);
}

}  // namespace
}  // namespace vitrine::web
