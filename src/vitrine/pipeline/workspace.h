// pipeline/workspace.h: the folder of a run: who holds it, what is done in it, and how it got
// there.
//
// Stages are numbered files (interfaces.md 4). Each stage has an identity: its name, its options,
// the hashes of its inputs. A stage whose identity is the one in run.json, and whose files are
// still what it wrote, is not run again: kill a run at any moment and the same command goes on.
#pragma once

#include "base/progress.h"

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace vitrine {

struct StageRecord {
    std::string identity;  ///< 16 hexadecimal digits
    double seconds = 0.0;
    double peak_mb = 0.0;  ///< largest memory of the process while the stage ran
    std::map<std::string, std::string> files;  ///< path in the workspace -> hash
    bool was_reused = false;                   ///< in this run
};

/// What was asked, kept in run.json.
struct RunInfo {
    std::string version;
    std::vector<std::string> arguments;
    std::string options_json = "{}";  ///< resolved options, an object
    std::uint64_t seed = 0;
};

class Workspace {
  public:
    /// Creates the folder, takes its lock and removes temporary files of a run that was killed.
    /// @throws MachineError when another run holds it (named by process id), or it is read-only.
    Workspace(const std::filesystem::path& folder, RunInfo info);
    ~Workspace();
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;

    const std::filesystem::path& folder() const { return folder_; }
    std::filesystem::path path(const std::string& name) const { return folder_ / name; }

    /// Runs `work` unless the stage is done. `inputs` are whatever decides the result: option text,
    /// hashes of files, identities of earlier stages. `outputs(…)` lists the files that it wrote,
    /// as paths relative to the folder; it is called after `work`. Returns the identity. The record
    /// is written after the files: a stage is done when all of it is on disk.
    std::string run_stage(const std::string& name, const std::vector<std::string>& inputs,
                          const std::function<void()>& work,
                          const std::function<std::vector<std::string>()>& outputs);

    const std::map<std::string, StageRecord>& stages() const { return stages_; }
    /// Order in which stages ran in this process.
    const std::vector<std::string>& order() const { return order_; }
    /// Told before and after each stage: (name, seconds or -1 when it starts, was reused).
    void on_stage(std::function<void(const std::string&, double, bool)> listener) {
        listener_ = std::move(listener);
    }

  private:
    void read_record();
    void write_record() const;
    bool is_done(const StageRecord& record, const std::string& identity) const;

    std::filesystem::path folder_;
    RunInfo info_;
    int lock_ = -1;
    std::map<std::string, StageRecord> stages_;
    std::vector<std::string> order_;
    std::function<void(const std::string&, double, bool)> listener_;
};

/// Hash of the names and contents of files given relative to `folder`, in their order.
std::string hash_files(const std::filesystem::path& folder, const std::vector<std::string>& files);
/// Hash of the names and contents of all regular files below `folder`.
std::string hash_folder(const std::filesystem::path& folder);
/// Files below `folder / sub`, relative to `folder`, sorted.
std::vector<std::string> files_below(const std::filesystem::path& folder, const std::string& sub);

}  // namespace vitrine
