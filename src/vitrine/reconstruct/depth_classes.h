// reconstruct/depth_classes.h: what a depth reading says about the surface that the other views
// saw.
#pragma once

#include "geometry/camera.h"
#include "image/image.h"

namespace vitrine {

enum class DepthClass : std::uint8_t {
    Unknown,  ///< no surface known there, and nothing measured
    Ok,       ///< agrees with the surface within three standard deviations
    Zero,     ///< no reading although there is a surface within range
    Shadow,   ///< no reading beside a depth step: the projector's light does not get there
    Through,  ///< behind the surface
    Front,    ///< before the surface, or before nothing
};
using DepthClasses = Image<DepthClass>;

/// Classifies each pixel of a depth image against the depth of the fused surface (both planar z).
/// @param baseline_m between projector and camera; decides how wide a depth shadow may be.
DepthClasses classify_depth(const ImageF& measured_m, const ImageF& model_m, const Camera& camera,
                            double max_depth_m, double baseline_m = 0.075);

inline bool is_bad(DepthClass c) {
    return c == DepthClass::Zero || c == DepthClass::Through || c == DepthClass::Front;
}

/// Regions where depth is missing or wrong: lines and speckles up to two pixels wide are dropped,
/// gaps between bad spots up to `2 * closing_px` wide are filled.
Mask bad_regions(const DepthClasses& classes, int closing_px = 6);

}  // namespace vitrine
