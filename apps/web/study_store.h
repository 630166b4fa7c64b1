// apps/web/study_store.h: the sessions of a study on disk. An answer is on disk before the next
// question is known; a reload, a crash or a second tab loses and doubles nothing.
//
// FOLDER/.lock                            held while a server runs
// FOLDER/participants/<id>/session.json   design options and seed, consent, calibration
//                          log.csv        one row per answer, appended and synced: the truth
//                          trials.csv     resp,S1,S2,S3,S4 of the main trials
#pragma once

#include "perception/design.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace vitrine::web {

struct Calibration {
    double px_per_mm = 0;  ///< CSS pixels; 0: not done yet
    double distance_mm = 550;
    double device_pixel_ratio = 1;
};

struct SessionState {
    std::string participant;
    int next = 0;   ///< index of the question to be answered; `total` when done
    int total = 0;  ///< with practice and catch trials
    bool has_consented = false;
    Calibration calibration;
    PlannedTrial trial;  ///< question `next`; meaningless when done
    bool is_done() const { return next >= total; }
};

struct Answer {
    int trial = 0;  ///< index of the question it answers
    bool chose_top = true;
    std::string key;  ///< key or "mouse"
    double reaction_ms = 0;
    double stimulus_size_px = 0;
};

/// True for 1 to 32 letters, digits, '-' and '_', beginning with a letter or digit.
bool is_participant_id(const std::string& text);

class StudyStore {
  public:
    /// @param design its `seed` is that of the study; each participant gets one of their own
    /// @throws MachineError when another process serves the folder or it cannot be written.
    StudyStore(std::filesystem::path folder, DesignOptions design);
    ~StudyStore();
    StudyStore(const StudyStore&) = delete;
    StudyStore& operator=(const StudyStore&) = delete;

    /// Begins a session or takes up an earlier one.
    /// @throws InputError for an id that is none, MachineError when the disk refuses
    SessionState open(const std::string& participant);
    SessionState give_consent(const std::string& participant);
    SessionState calibrate(const std::string& participant, const Calibration& calibration);
    /// Writes the answer and returns what comes next. An answer to any other question than the one
    /// at hand (sent twice, or from a second tab) changes nothing; the state says what is due.
    SessionState answer(const std::string& participant, const Answer& answer);

  private:
    struct Session;
    Session& session(const std::string& participant);
    std::unique_ptr<Session> load(const std::string& participant, int folder_descriptor);
    void save_settings(const Session& session) const;

    std::filesystem::path folder_;
    DesignOptions design_;
    int lock_ = -1;
    std::mutex mutex_;
    std::map<std::string, std::unique_ptr<Session>> sessions_;
};

}  // namespace vitrine::web
