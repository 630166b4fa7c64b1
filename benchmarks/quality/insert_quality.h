// benchmarks/quality/insert_quality.h: insertions with true parameters beside true pictures.
#pragma once

#include "plain_quality.h"

namespace vitrine {

/// Prints, per frame and region, the error and how far it is above the truth's noise, far off and
/// in place, our own noise, and what is left against paths alone.
void compare_insertion(const RenderQualityOptions& options, const TruthScene& truth);

}  // namespace vitrine
