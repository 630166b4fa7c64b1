// scene/relief.h: the object of one photograph as a height field, and the lights on it.
//
// Viewer frame: x right, y UP, z toward the viewer, the view direction is (0, 0, 1), orthographic.
// Lengths in pixels of the photograph: pixel (column, row) is the point (column, -row).
#pragma once

#include "image/image.h"

#include <string>
#include <vector>

namespace vitrine {

struct Relief {
    Mask mask;                  ///< 255 where there is an object
    ImageF depth_px;            ///< height above the silhouette plane z = 0; 0 outside
    Image<Vec3f> normals;       ///< unit, viewer frame; (0, 0, 1) outside
    Image<Vec3f> base_normals;  ///< of the smooth base without shading detail; empty: use `normals`
    double inradius_px = 0;     ///< of the mask: the unit of every length parameter

    Vec3f point(int x, int y) const {
        return {static_cast<float>(x), static_cast<float>(-y), depth_px(x, y)};
    }
};

/// A distant light in the viewer frame. Directions with z < 0 shine from behind.
struct ViewLight {
    Vec3 direction = Vec3(0, 0, 1);  ///< unit, toward the light
    Rgbd intensity = Rgbd::Ones();   ///< irradiance on a surface facing it
};

/// All light on an object: distant lights and a constant from everywhere.
///
/// R_d and light are only known up to a common factor, so intensities are scaled such that the
/// brightest front-facing surface gets irradiance pi: a white Lambertian there shows 1.
struct ViewLights {
    std::vector<ViewLight> lights;
    Rgbd ambient = Rgbd::Zero();  ///< irradiance

    double total() const {
        double sum = luminance(ambient);
        for (const ViewLight& light : lights) sum += luminance(light.intensity);
        return sum;
    }
};

}  // namespace vitrine
