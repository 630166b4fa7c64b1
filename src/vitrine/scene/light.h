// scene/light.h: what emits. Intensities in W/sr, irradiance in W/m2, radiance in W/(m2 sr).
#pragma once

#include "image/image.h"

#include <memory>
#include <string>
#include <variant>

namespace vitrine {

struct PointLight {
    Vec3 position_m = Vec3::Zero();
    Rgb intensity_w_per_sr = Rgb::Constant(1.0f);  ///< the same in all directions
};

/// One-sided uniform Lambertian disc.
struct DiscLight {
    Vec3 position_m = Vec3::Zero();
    Vec3 normal = Vec3(0, 0, -1);  ///< unit, the side that emits
    double radius_m = 0.05;
    Rgb intensity_w_per_sr = Rgb::Constant(1.0f);  ///< on the axis = radiance * area
};

/// Point light within a cone, smooth over the outer 10 % of the half angle.
struct SpotLight {
    Vec3 position_m = Vec3::Zero();
    Vec3 direction = Vec3(0, 0, -1);
    Rgb intensity_w_per_sr = Rgb::Constant(1.0f);  ///< on the axis
    double cone_deg = 30.0;                        ///< full opening angle
};

struct DirectionalLight {
    Vec3 direction = Vec3(0, 0, -1);                ///< of travel, away from the light
    Rgb irradiance_w_per_m2 = Rgb::Constant(1.0f);  ///< on a surface facing it
};

/// Lat-long radiance map: row 0 is +z, column 0 is azimuth -pi, azimuth from +x to +y.
struct EnvironmentLight {
    std::shared_ptr<const ImageRgb> radiance;
    std::string file;
    double scale = 1.0;
};

using Light = std::variant<PointLight, DiscLight, SpotLight, DirectionalLight, EnvironmentLight>;

std::string kind_name(const Light& light);

}  // namespace vitrine
