#include "compose/object_irradiance.h"

#include "image/filter.h"
#include "image/poisson.h"

namespace vitrine {

ObjectIrradiance object_irradiance(const PhotoAnalysis& object, IrradianceSource source,
                                   bool is_object_neutral, double eta, double object_albedo) {
    const Mask& mask = object.photo.mask;
    const Relief& relief = object.relief;
    ObjectIrradiance result;
    result.irradiance = irradiance_from_lights(relief, object.lights.lights, eta);

    // Rim pixels are mixed with the background: they borrow from inside.
    const Mask inner = erode(mask, 2);
    const ImageRgb shading =
        extend_nearest(object.highlights.diffuse, count_inside(inner) > 0 ? inner : mask);
    double model_sum = 0, photo_sum = 0;
    Rgbd colour = Rgbd::Zero();
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127 || relief.normals[i].z() < 0.3f) continue;
        model_sum += luminance(result.irradiance.front[i]);
        photo_sum += luminance(shading[i]);
        colour += shading[i].cast<double>();
    }
    if (photo_sum <= 0 || model_sum <= 0) return result;
    const double unit = model_sum / photo_sum;
    result.level = kPi / (object_albedo * unit);
    if (source == IrradianceSource::Lights) return result;
    const Rgbd paint =
        is_object_neutral ? Rgbd::Ones().eval() : (colour / luminance(colour)).eval();
    const Rgb factor = (unit / paint.max(1e-6)).cast<float>();
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (mask[i] > 127) result.irradiance.front[i] = shading[i] * factor;
    return result;
}

}  // namespace vitrine
