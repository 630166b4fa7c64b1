// estimate/paper_rule.h: glass or metal by the sum of brightness, as the paper prints it
// (section 5.2). Chance on made scenes; kept for comparison.
#pragma once

#include "estimate/object_context.h"
#include "estimate/transparent.h"

namespace vitrine {

struct PaperRule {
    double specular = 0.0;     ///< sum of b: n.l shading of the scan's own reflectance (Eq. 8)
    double transparent = 0.0;  ///< sum of t: the view through the object at index 1.2
    double seen = 0.0;         ///< sum of c
    /// ln(|b - c| / |t - c|): > 0 says transparent; a tie is 0.
    double margin() const;
};

/// Sums luminance over the pixels for which the view through the object is known. Eq. 8 lacks 1/r^2
/// and a reflectance; both are put in. @param reflectance radiance per irradiance of the scan
PaperRule paper_rule(const ObjectContext& context, int object,
                     const std::vector<ObjectPixel>& pixels, double reflectance);

/// The view through a solid of index `ior` as the paper has it: no Fresnel losses, no reflections.
std::vector<ThroughPixel> look_through_plainly(const EstimationScene& scene,
                                               const FrameLookup& lookup, int object,
                                               const std::vector<ObjectPixel>& pixels, double ior);

}  // namespace vitrine
