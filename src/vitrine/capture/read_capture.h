// capture/read_capture.h: reading captures, for those who need more than `read_capture(folder)`.
#pragma once

#include "capture/capture.h"

#include <span>

namespace vitrine {

struct CaptureListing;

struct CaptureReader {
    const char* name;    ///< as messages say it
    const char* layout;  ///< what marks such a folder
    bool (*recognises)(const std::filesystem::path& folder);
    CaptureListing (*list)(const std::filesystem::path& folder);
};

/// In the order in which they are tried.
std::span<const CaptureReader> capture_readers();

/// The reader of a folder. @throws InputError naming all layouts when none recognises it.
const CaptureReader& find_capture_reader(const std::filesystem::path& folder);

/// Every file that `read_capture` looks at: when one changes, the capture is another.
std::vector<std::filesystem::path> capture_files(const std::filesystem::path& folder);

struct CaptureReadOptions {
    /// Memory for pictures: of a longer recording, frames are taken at even steps. 2 GB are 570
    /// frames of 640 x 360, 64 of 1920 x 1080.
    std::size_t max_bytes = std::size_t(2) << 30;
};
Capture read_capture(const std::filesystem::path& folder, const CaptureReadOptions& options,
                     const Progress& progress);

inline std::vector<Camera> cameras_of(const Capture& capture) {
    std::vector<Camera> cameras;
    for (const RgbdFrame& frame : capture.frames) cameras.push_back(frame.camera);
    return cameras;
}

}  // namespace vitrine
