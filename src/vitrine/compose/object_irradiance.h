// compose/object_irradiance.h: the light that falls on the object of a photograph.
#pragma once

#include "compose/transfer.h"

namespace vitrine {

struct ObjectIrradiance {
    ReliefIrradiance irradiance;  ///< brightest visible about pi
    double level = 1;  ///< linear value of the photo that white shows under irradiance pi
};

/// From the lights alone, or with the visible side read off the photo: an opaque object of one
/// albedo is its own light meter, so shadows, bounced and coloured light are kept as they are. The
/// mean colour is taken for the object's paint unless `is_object_neutral`; deviations from it are
/// taken for coloured light.
ObjectIrradiance object_irradiance(const PhotoAnalysis& object, IrradianceSource source,
                                   bool is_object_neutral, double eta, double object_albedo);

}  // namespace vitrine
