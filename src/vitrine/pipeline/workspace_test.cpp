#include "pipeline/workspace.h"

#include "base/error.h"
#include "base/file.h"
#include "base/scratch_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sys/wait.h>
namespace vitrine {
namespace {

namespace fs = std::filesystem;

class WorkspaceTest : public testing::Test {
  protected:
    ScratchFolder folder_{"workspace"};
    int runs_ = 0;

    std::string run(Workspace& workspace, const std::string& options) {
        return workspace.run_stage(
            "first", {options},
            [&] {
                ++runs_;
                write_text_file(workspace.path("a.txt"), "result of " + options);
            },
            [] { return std::vector<std::string>{"a.txt"}; });
    }
};

TEST_F(WorkspaceTest, AStageRunsOnceUntilSomethingChanges) {
    {
        Workspace workspace(folder_, {"1", {}, "{}", 0});
        run(workspace, "x");
        run(workspace, "x");
    }
    EXPECT_EQ(runs_, 1);
    {
        Workspace workspace(folder_, {"1", {}, "{}", 0});
        run(workspace, "x");
        EXPECT_EQ(runs_, 1);  // another process, the same inputs
        run(workspace, "y");
        EXPECT_EQ(runs_, 2);  // another option
        write_text_file(folder_ / "a.txt", "touched by someone");
        run(workspace, "y");
        EXPECT_EQ(runs_, 3);  // its file is not what it wrote
    }
    Workspace newer(folder_, {"2", {}, "{}", 0});
    run(newer, "y");
    EXPECT_EQ(runs_, 4);  // another version of the program
}

TEST_F(WorkspaceTest, AStageThatFailedIsNotDone) {
    Workspace workspace(folder_, {"1", {}, "{}", 0});
    const auto failing = [&] {
        workspace.run_stage(
            "first", {"x"}, [] { throw MachineError("disk full"); },
            [] { return std::vector<std::string>{}; });
    };
    EXPECT_THROW(failing(), MachineError);
    run(workspace, "x");
    EXPECT_EQ(runs_, 1);
}

TEST_F(WorkspaceTest, TheSecondRunIsToldWhoHoldsIt) {
    Workspace workspace(folder_, {"1", {}, "{}", 0});
    const pid_t child = ::fork();
    if (child == 0) {
        int status = 1;
        try {
            Workspace second(folder_, {"1", {}, "{}", 0});
        } catch (const MachineError& error) {
            const std::string holder = std::to_string(::getppid());
            status = std::string(error.what()).find(holder) != std::string::npos ? 0 : 2;
        }
        ::_exit(status);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(WorkspaceTest, LeftOversOfAKilledRunAreRemovedAndABadRecordIsNoHarm) {
    fs::create_directories(folder_);
    write_text_file(folder_ / "run.json", "{ half a rec");
    { std::ofstream(folder_ / "mesh.tmp123.ply") << "half"; }
    Workspace workspace(folder_, {"1", {}, "{}", 0});
    EXPECT_FALSE(fs::exists(folder_ / "mesh.tmp123.ply"));
    run(workspace, "x");
    EXPECT_EQ(runs_, 1);
}

}  // namespace
}  // namespace vitrine
