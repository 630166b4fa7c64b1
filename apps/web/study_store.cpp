#include "study_store.h"

#include "base/error.h"
#include "base/file.h"
#include "base/json_reader.h"
#include "base/log.h"
#include "base/rng.h"

#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace vitrine::web {
namespace fs = std::filesystem;
namespace {

constexpr const char* kLogHeader =
    "participant,trial,kind,resp,S1,S2,S3,S4,top_left,top_right,bottom_left,bottom_right,choice,"
    "key,reaction_ms,stimulus_size_px,time_utc,seed\n";

[[noreturn]] void fail(const fs::path& path, const std::string& doing) {
    throw MachineError(fmt::format("cannot {} {}: {}", doing, path.string(), std::strerror(errno)));
}

class Descriptor {
  public:
    explicit Descriptor(int value) : value_(value) {}
    ~Descriptor() {
        if (value_ >= 0) ::close(value_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return value_; }

  private:
    int value_;
};

/// A folder below `parent`, made when missing, never reached through a link.
int open_folder(int parent, const char* name, const fs::path& shown) {
    if (::mkdirat(parent, name, 0755) != 0 && errno != EEXIST) fail(shown, "make");
    const int descriptor = ::openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (descriptor < 0) fail(shown, "open the folder");
    return descriptor;
}

std::string utc_now() {
    const auto now = std::chrono::system_clock::now();
    const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch());
    std::tm parts{};
    ::gmtime_r(&seconds, &parts);
    return fmt::format("{:04d}-{:02d}-{:02d}T{:02d}:{:02d}:{:02d}.{:03d}Z", parts.tm_year + 1900,
                       parts.tm_mon + 1, parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec,
                       ms.count() % 1000);
}

/// What a page may call a key, so that no comma or quote enters the log.
std::string safe_word(const std::string& text) {
    std::string safe;
    for (const char c : text) {
        if (std::isalnum(static_cast<unsigned char>(c)) || c == '_') safe += c;
    }
    return safe.substr(0, 16);
}

std::string read_all(int descriptor, const fs::path& shown) {
    std::string text;
    char buffer[65536];
    while (true) {
        const ssize_t got = ::read(descriptor, buffer, sizeof buffer);
        if (got < 0) fail(shown, "read");
        if (got == 0) return text;
        text.append(buffer, static_cast<std::size_t>(got));
    }
}

}  // namespace

bool is_participant_id(const std::string& text) {
    if (text.empty() || text.size() > 32) return false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto c = static_cast<unsigned char>(text[i]);
        const bool is_word = c < 128 && std::isalnum(c);
        if (!is_word && (i == 0 || (c != '-' && c != '_'))) return false;
    }
    return true;
}

struct StudyStore::Session {
    fs::path folder;
    int log = -1;
    SessionState state;
    DesignOptions design;
    std::vector<PlannedTrial> trials;
    std::vector<Trial> main_answers;
    ~Session() {
        if (log >= 0) ::close(log);
    }
};

StudyStore::StudyStore(fs::path folder, DesignOptions design)
    : folder_(std::move(folder)), design_(design) {
    make_design(design_);  // refuses impossible options now and not at the first participant
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) throw MachineError("cannot make " + folder_.string() + ": " + error.message());
    const fs::path path = folder_ / ".lock";
    lock_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644);
    if (lock_ < 0) fail(path, "open");
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
        const std::string owner = read_all(lock_, path);
        ::close(lock_);
        throw MachineError(fmt::format("{} is served already by process {}", folder_.string(),
                                       owner.empty() ? "unknown" : owner));
    }
    const std::string id = std::to_string(::getpid());
    if (::ftruncate(lock_, 0) != 0 || ::pwrite(lock_, id.data(), id.size(), 0) < 0) {
        fail(path, "write");
    }
}

StudyStore::~StudyStore() {
    if (lock_ >= 0) ::close(lock_);
}

void StudyStore::save_settings(const Session& s) const {
    const Calibration& c = s.state.calibration;
    Json root;
    root["schema"] = "vitrine.mlds_session/1";
    root["participant"] = s.state.participant;
    root["design"] = {{"stimulus_count", s.design.stimulus_count},
                      {"trial_count", s.design.trial_count},
                      {"repeats", s.design.repeats},
                      {"practice_count", s.design.practice_count},
                      {"catch_count", s.design.catch_count},
                      {"seed", s.design.seed}};
    root["has_consented"] = s.state.has_consented;
    root["calibration"] = {{"px_per_mm", c.px_per_mm},
                           {"distance_mm", c.distance_mm},
                           {"device_pixel_ratio", c.device_pixel_ratio}};
    write_json_file(s.folder / "session.json", root);
}

std::unique_ptr<StudyStore::Session> StudyStore::load(const std::string& participant,
                                                      int folder_descriptor) {
    auto s = std::make_unique<Session>();
    s->folder = folder_ / "participants" / participant;
    s->state.participant = participant;
    const fs::path settings = s->folder / "session.json";
    const Descriptor file(
        ::openat(folder_descriptor, "session.json", O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
    if (file.get() < 0 && errno != ENOENT) fail(settings, "open");
    if (file.get() < 0) {
        s->design = design_;
        // 53 bits: the seed stays exact in JSON and in a spreadsheet.
        s->design.seed = stream_key(design_.seed, hash_bytes(participant)) >> 11;
        save_settings(*s);
    } else {
        const JsonObject root = read_json_text(read_all(file.get(), settings), settings.string());
        root.choice("schema", {"vitrine.mlds_session/1"});
        root.choice("participant", {participant});
        const JsonObject design = root.object("design");
        s->design.stimulus_count = static_cast<int>(design.integer("stimulus_count"));
        s->design.trial_count = static_cast<int>(design.integer("trial_count"));
        s->design.repeats = static_cast<int>(design.integer("repeats"));
        s->design.practice_count = static_cast<int>(design.integer("practice_count"));
        s->design.catch_count = static_cast<int>(design.integer("catch_count"));
        s->design.seed = static_cast<std::uint64_t>(design.integer("seed"));
        design.finish();
        s->state.has_consented = root.boolean_or("has_consented", false);
        const JsonObject calibration = root.object("calibration");
        s->state.calibration.px_per_mm = calibration.number("px_per_mm");
        s->state.calibration.distance_mm = calibration.number("distance_mm");
        s->state.calibration.device_pixel_ratio = calibration.number("device_pixel_ratio");
        calibration.finish();
        root.finish();
        if (s->design.stimulus_count != design_.stimulus_count) {
            throw InputError({settings.string(),
                              fmt::format("{} stimuli as now served", design_.stimulus_count),
                              std::to_string(s->design.stimulus_count),
                              "serve the pictures this session began with"});
        }
    }
    s->trials = make_design(s->design);
    s->state.total = static_cast<int>(s->trials.size());
    return s;
}

StudyStore::Session& StudyStore::session(const std::string& participant) {
    if (!is_participant_id(participant)) {
        throw InputError({"participant code", "1 to 32 letters, digits, - and _",
                          fmt::format("{} characters", participant.size()), ""});
    }
    const auto known = sessions_.find(participant);
    if (known != sessions_.end()) return *known->second;

    const fs::path all = folder_ / "participants";
    const Descriptor study(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (study.get() < 0) fail(folder_, "open the folder");
    const Descriptor participants(open_folder(study.get(), "participants", all));
    const Descriptor own(open_folder(participants.get(), participant.c_str(), all / participant));
    std::unique_ptr<Session> s = load(participant, own.get());
    const fs::path log_path = s->folder / "log.csv";
    s->log =
        ::openat(own.get(), "log.csv", O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_APPEND, 0644);
    if (s->log < 0) fail(log_path, "open");
    std::string text = read_all(s->log, log_path);
    const std::size_t whole = text.empty() ? 0 : text.rfind('\n') + 1;  // npos + 1 = 0
    if (whole < text.size()) {
        // The last write was cut by a crash; its answer was never confirmed to the page.
        log_warning("{}: dropped {} bytes of an unfinished line", log_path.string(),
                    text.size() - whole);
        if (::ftruncate(s->log, static_cast<off_t>(whole)) != 0) fail(log_path, "shorten");
        text.resize(whole);
    }
    if (text.empty()) {
        const std::string_view header = kLogHeader;
        if (::write(s->log, header.data(), header.size()) != static_cast<ssize_t>(header.size()) ||
            ::fsync(s->log) != 0 || ::fsync(own.get()) != 0 || ::fsync(participants.get()) != 0) {
            fail(log_path, "write");
        }
    } else {
        for (std::size_t at = text.find('\n') + 1; at < text.size(); at = text.find('\n', at) + 1) {
            const std::string row = text.substr(at, text.find('\n', at) - at);
            const auto i = static_cast<std::size_t>(s->state.next);
            if (i >= s->trials.size()) break;
            const PlannedTrial& t = s->trials[i];
            const std::string expected =
                fmt::format("{},{},{},", participant, i + 1, kind_name(t.kind));
            const std::string asked =
                fmt::format(",{},{},{},{},", t.rank[0], t.rank[1], t.rank[2], t.rank[3]);
            if (row.rfind(expected, 0) != 0 || row.size() < expected.size() + 1 ||
                row.compare(expected.size() + 1, asked.size(), asked) != 0) {
                throw InputError({fmt::format("{}:{}", log_path.string(), i + 2),
                                  "the question that the design asks there", row, ""});
            }
            if (t.kind == TrialKind::Main) {
                s->main_answers.push_back({row[expected.size()] - '0', t.rank});
            }
            ++s->state.next;
        }
    }
    if (!s->state.is_done()) s->state.trial = s->trials[static_cast<std::size_t>(s->state.next)];
    return *sessions_.emplace(participant, std::move(s)).first->second;
}

SessionState StudyStore::open(const std::string& participant) {
    const std::lock_guard<std::mutex> guard(mutex_);
    return session(participant).state;
}

SessionState StudyStore::give_consent(const std::string& participant) {
    const std::lock_guard<std::mutex> guard(mutex_);
    Session& s = session(participant);
    s.state.has_consented = true;
    save_settings(s);
    return s.state;
}

SessionState StudyStore::calibrate(const std::string& participant, const Calibration& c) {
    if (!(c.px_per_mm > 0.5 && c.px_per_mm < 50) ||
        !(c.distance_mm >= 200 && c.distance_mm <= 3000) ||
        !(c.device_pixel_ratio > 0.1 && c.device_pixel_ratio < 20)) {
        throw InputError({"calibration", "0.5 to 50 pixels per mm at 20 to 300 cm",
                          fmt::format("{} px/mm at {} mm", c.px_per_mm, c.distance_mm), ""});
    }
    const std::lock_guard<std::mutex> guard(mutex_);
    Session& s = session(participant);
    s.state.calibration = c;
    save_settings(s);
    return s.state;
}

SessionState StudyStore::answer(const std::string& participant, const Answer& answer) {
    const std::lock_guard<std::mutex> guard(mutex_);
    Session& s = session(participant);
    if (s.state.is_done() || answer.trial != s.state.next) return s.state;
    const PlannedTrial& t = s.state.trial;
    const int response = response_of(t, answer.chose_top);
    const Quadruple screen = screen_order(t);
    const std::string row =
        fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{:.1f},{:.1f},{},{}\n", participant,
                    answer.trial + 1, kind_name(t.kind), response, t.rank[0], t.rank[1], t.rank[2],
                    t.rank[3], screen[0], screen[1], screen[2], screen[3],
                    answer.chose_top ? "top" : "bottom", safe_word(answer.key), answer.reaction_ms,
                    answer.stimulus_size_px, utc_now(), s.design.seed);
    const off_t before = ::lseek(s.log, 0, SEEK_END);
    const ssize_t written = ::write(s.log, row.data(), row.size());
    if (written != static_cast<ssize_t>(row.size()) || ::fsync(s.log) != 0) {
        const int why = errno;
        // A half row would be taken for an answer's beginning later: take it back.
        if (::ftruncate(s.log, before) != 0) log_warning("cannot shorten the log again");
        errno = why;
        fail(s.folder / "log.csv", "write");
    }
    if (t.kind == TrialKind::Main) {
        s.main_answers.push_back({response, t.rank});
        write_text_file(s.folder / "trials.csv", trials_to_csv(s.main_answers));
    }
    ++s.state.next;
    if (!s.state.is_done()) s.state.trial = s.trials[static_cast<std::size_t>(s.state.next)];
    return s.state;
}

}  // namespace vitrine::web
