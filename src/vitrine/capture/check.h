// capture/check.h: whether a capture can be used, and what is wrong with it, in plain words.
#pragma once

#include "capture/capture.h"

namespace vitrine {

enum class Severity { Good, Note, Problem };

struct Verdict {
    Severity severity;
    std::string sentence;
};

/// Looks at a readable capture: coverage, depth, exposure, blur, parallax, reference albedo.
/// Costs about 10 ms per frame.
std::vector<Verdict> check_capture(const Capture& capture);

/// Refuses what no stage could use: no frame, no valid depth, all poses equal, a depth unit that
/// the poses contradict, a reference albedo outside the pictures.
/// @throws InputError
void require_usable(const Capture& capture, const std::filesystem::path& folder,
                    double depth_scale);

/// Share of depth pixels that agree to 3 % with the depth of the next frame's view of the same
/// point, when all depths are multiplied by `factor`. 0 when there are no poses.
double depth_consistency(const Capture& capture, double factor);

}  // namespace vitrine
