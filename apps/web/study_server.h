// apps/web/study_server.h: the local page of a difference-scaling study.
//
// Loopback only; a random token per start, asked for by every request but the page's own files;
// Host and Origin are checked; no CORS; bodies up to 16 KB; Range and chunked bodies are refused;
// pictures are in memory, by number: no request names a file.
#pragma once

#include "perception/design.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace vitrine::web {

struct StudyPage {
    std::string title;
    std::vector<std::string> pictures;  ///< PNG bytes, one per rank
    double distance_mm = 550;           ///< the paper's viewing distance
    double picture_deg = 8.0;           ///< visual angle of one picture's side
    int break_every = 70;               ///< trials between rests
};

/// Reads the PNGs of a rendered series, refusing links and names with folders.
std::vector<std::string> read_pictures(const std::filesystem::path& folder,
                                       const std::vector<std::string>& files);

class StudyServer {
  public:
    /// @param port 0: any free one
    /// @throws MachineError when the port is taken or the study folder is served already
    StudyServer(StudyPage page, const std::filesystem::path& study_folder,
                const DesignOptions& design, int port);
    ~StudyServer();

    /// The address to open: the token is behind '#', which browsers never send.
    const std::string& url() const;
    /// Serves until `should_stop`, asked five times a second, says so.
    void serve(const std::function<bool()>& should_stop);

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace vitrine::web
