#include "pipeline/workspace.h"

#include "base/error.h"
#include "base/file.h"
#include "base/json_reader.h"
#include "base/timer.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <sys/file.h>
#include <unistd.h>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

constexpr const char* kLockName = ".lock";

std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

/// Peak memory of this process since the last reset, from the kernel's own accounting.
double peak_memory_mb() {
    std::ifstream status("/proc/self/status");
    std::string line;
    while (std::getline(status, line)) {
        if (line.rfind("VmHWM:", 0) == 0) return std::atof(line.c_str() + 6) / 1024.0;
    }
    return 0.0;
}

void reset_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }

void remove_temporaries(const fs::path& folder) {
    std::vector<fs::path> stale;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (entry.is_regular_file() && name.find(".tmp") != std::string::npos)
            stale.push_back(entry.path());
    }
    for (const fs::path& path : stale) fs::remove(path);
}

}  // namespace

Workspace::Workspace(const fs::path& folder, RunInfo info)
    : folder_(folder), info_(std::move(info)) {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error || !fs::is_directory(folder_)) {
        throw MachineError(fmt::format("cannot make the folder {}: {}", folder_.string(),
                                       error ? error.message() : "a file is in the way"));
    }
    const fs::path lock = folder_ / kLockName;
    lock_ = ::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (lock_ < 0) {
        throw MachineError(
            fmt::format("cannot write in {}: {}", folder_.string(), std::strerror(errno)));
    }
    // The kernel drops the lock when its holder dies, however it dies.
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
        std::string holder = read_text_file(lock);
        ::close(lock_);
        lock_ = -1;
        throw MachineError(
            fmt::format("{} is in use by another run (process {}): wait for it, or choose "
                        "another --out",
                        folder_.string(), holder));
    }
    const std::string process = std::to_string(::getpid());
    if (::ftruncate(lock_, 0) != 0 || ::pwrite(lock_, process.data(), process.size(), 0) !=
                                          static_cast<ssize_t>(process.size())) {
        throw MachineError(
            fmt::format("cannot write in {}: {}", folder_.string(), std::strerror(errno)));
    }
    remove_temporaries(folder_);
    read_record();
}

Workspace::~Workspace() {
    if (lock_ >= 0) ::close(lock_);
}

void Workspace::read_record() {
    const fs::path file = folder_ / "run.json";
    if (!fs::exists(file)) return;
    try {
        const JsonObject object = read_json_file(file);
        const JsonObject stages = object.object("stages");
        for (const std::string& name : stages.keys()) {
            const JsonObject stage = stages.object(name);
            StageRecord record;
            record.identity = stage.text("identity");
            record.seconds = stage.number("seconds");
            record.peak_mb = stage.number("peak_mb");
            const JsonObject files = stage.object("files");
            for (const std::string& path : files.keys()) record.files[path] = files.text(path);
            stages_[name] = record;
        }
    } catch (const InputError&) {
        // A record that cannot be read vouches for nothing: every stage runs again.
        stages_.clear();
    }
}

void Workspace::write_record() const {
    Json json;
    json["schema"] = "vitrine.run/1";
    json["version"] = info_.version;
    json["arguments"] = info_.arguments;
    json["options"] = Json::parse(info_.options_json);
    json["seed"] = info_.seed;
    json["stages"] = Json::object();
    for (const auto& [name, record] : stages_) {
        json["stages"][name] = {{"identity", record.identity},
                                {"seconds", record.seconds},
                                {"peak_mb", record.peak_mb},
                                {"files", record.files}};
    }
    write_json_file(folder_ / "run.json", json);
}

bool Workspace::is_done(const StageRecord& record, const std::string& identity) const {
    if (record.identity != identity) return false;
    for (const auto& [name, hash] : record.files) {
        const fs::path file = folder_ / name;
        if (!fs::is_regular_file(file) || hex(hash_file(file)) != hash) return false;
    }
    return true;
}

std::string Workspace::run_stage(const std::string& name, const std::vector<std::string>& inputs,
                                 const std::function<void()>& work,
                                 const std::function<std::vector<std::string>()>& outputs) {
    std::string text = info_.version + "\n" + name + "\n";
    for (const std::string& input : inputs) text += input + "\n";
    const std::string identity = hex(hash_bytes(text));
    const auto found = stages_.find(name);
    if (found != stages_.end() && is_done(found->second, identity)) {
        found->second.was_reused = true;
        order_.push_back(name);
        if (listener_) listener_(name, found->second.seconds, true);
        return identity;
    }
    if (listener_) listener_(name, -1.0, false);
    stages_.erase(name);
    write_record();
    reset_peak_memory();
    const Timer timer;
    work();
    StageRecord record;
    record.identity = identity;
    record.seconds = timer.seconds();
    record.peak_mb = peak_memory_mb();
    for (const std::string& file : outputs()) record.files[file] = hex(hash_file(folder_ / file));
    stages_[name] = record;
    order_.push_back(name);
    write_record();
    if (listener_) listener_(name, record.seconds, false);
    return identity;
}

std::vector<std::string> files_below(const fs::path& folder, const std::string& sub) {
    std::vector<std::string> files;
    if (!fs::is_directory(folder / sub)) return files;
    for (const auto& entry : fs::recursive_directory_iterator(folder / sub)) {
        if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), folder).string());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::string hash_files(const fs::path& folder, const std::vector<std::string>& files) {
    std::uint64_t hash = hash_bytes("");
    for (const std::string& file : files) {
        hash = hash_bytes(file + " " + hex(hash_file(folder / file)), hash);
    }
    return hex(hash);
}

std::string hash_folder(const fs::path& folder) {
    return hash_files(folder, files_below(folder, ""));
}

}  // namespace vitrine
