// render/soft_light.h: light from other surfaces, averaged over neighbouring pixels.
//
// What a diffuse surface receives from other surfaces and from the environment, and what a virtual
// object changes of it, varies along the surface no faster than over a part of the distance to
// what sends it (Ward and Heckbert 1992, "Irradiance gradients"; Mehta et al. 2013, "Axis-aligned
// filtering for interactive physically-based diffuse indirect lighting"). A mean over an area much
// smaller than that is nearly free of bias and has far less noise than the paths of one pixel.
#pragma once

#include "geometry/camera.h"
#include "image/image.h"
#include "math/vector.h"

namespace vitrine {

/// Per unit of albedo: albedo times this is radiance.
struct SoftValue {
    Rgb with = Rgb::Zero();    ///< in the scene with the virtual parts
    Rgb shadow = Rgb::Zero();  ///< with less without, by layer
    Rgb diffuse = Rgb::Zero();
    float variance = 0;  ///< of the luminance of what matters
    float weight = 0;    ///< paths it rests on; 0: none
};

struct SoftPixel {
    SoftValue value;
    Vec3f position = Vec3f::Zero();
    Vec3f normal = Vec3f::Zero();  ///< unit; zero: the pixel shows no such surface
    float inverse_square_sum = 0;  ///< of distances, 1/m2, to the surfaces that paths from here met
    int hits = 0;                  ///< how many did
};

/// Replaces each value by a mean over neighbours in one plane with it, over a standard deviation of
/// a tenth of the mean distance of what paths meet, near things counting most, and 18 pixels at
/// most (an a-trous pyramid, Dammertz et al. 2010). A pixel without paths takes those of its
/// neighbours. The variance becomes that of the mean. Costs about 1 us a pixel.
void average_soft_light(Image<SoftPixel>& pixels, const Camera& camera);

}  // namespace vitrine
