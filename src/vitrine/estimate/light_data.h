// estimate/light_data.h: what lights are fitted to, made once per scene. Internal to the light
// estimators.
#pragma once

#include "estimate/light_fit.h"
#include "estimate/lights.h"

#include <optional>
#include <span>
#include <string>

namespace vitrine {

/// Samples of the scan and what shadows them. Keeps references to scene and frames; neither copied
/// nor moved, because its members point at each other.
struct LightData {
    LightData(const Scene& scene, std::span<const RgbdFrame> frames, double saturation_level,
              const LightOptions& options);
    LightData(const LightData&) = delete;
    LightData& operator=(const LightData&) = delete;

    EstimationScene world;
    FrameLookup lookup;
    std::uint32_t opaque_mask = kScanMask, see_through_mask = 0;
    ScanSamples samples;
    std::optional<ReferenceSample> reference;
    std::string problem;  ///< why no light can be found in them; empty when one can

    /// An estimate that knows the place and has no light yet; `problem` is its reason.
    LightEstimate start_estimate() const;
};

}  // namespace vitrine
