// reconstruct/labelled_scene.h: scan and candidates merged to one scene with names.
#pragma once

#include "reconstruct/candidates.h"
#include "scene/scene.h"

namespace vitrine {

struct LabelledSceneOptions {
    double plane_cell_m = 0.004;       ///< of the rebuilt support plane
    double plane_tolerance_m = 0.006;  ///< scan within this of the plane is taken to be the plane
    double hull_margin_m = 0.008;      ///< scan within this of a hull belongs to the object
};

/// Part "scan" (diffuse, colours of the vertices: radiance, not yet albedo) and one closed part per
/// candidate, named by its id, diffuse until someone knows better; cameras; no lights.
///
/// The support plane is rebuilt flat, closed under the objects; its colour there is diffused in
/// from around. Surface that the sensor invented inside or around a candidate is left out.
Scene build_scene(const Scan& scan, const Candidates& candidates,
                  const LabelledSceneOptions& options = {});

}  // namespace vitrine
