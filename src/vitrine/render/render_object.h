// render/render_object.h: an object of one photograph rendered whole, with its own shadows: one
// relief, or the balls of a cluster one by one.
#pragma once

#include "render/relief_light.h"
#include "render/translucent_relief.h"

namespace vitrine {

/// Irradiance that enters on both sides of a relief of one body, with the object's own shadows,
/// which are computed on a lattice and carried to full resolution: soft by a cell.
ReliefIrradiance irradiance_with_shadows(const Relief& relief, const ViewLights& lights,
                                         double eta);

/// Radiance toward the viewer, without reflections; 0 outside the mask. Pixels of a cluster that
/// show no known ball take their colour from the nearest that do. `profile` in pixels.
ImageRgb render_object(const Relief& relief, const ViewLights& lights, const RadialProfile& profile,
                       const TranslucentRenderOptions& options = {});

}  // namespace vitrine
