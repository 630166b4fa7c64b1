// estimate/translucent_world.h: worlds of known truth for the tests of half B: an ellipsoid of
// known profile under known lights, rendered with the renderer that the tests do not question.
#pragma once

#include "optics/dipole.h"
#include "render/translucent_relief.h"

namespace vitrine::testing_world {

inline Relief ellipsoid(int size, double a, double b) {
    Relief relief;
    relief.mask = Mask(size, size);
    relief.depth_px = ImageF(size, size);
    relief.normals = Image<Vec3f>(size, size, Vec3f(0, 0, 1));
    relief.inradius_px = std::min(a, b);
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double u = x - 0.5 * (size - 1), v = 0.5 * (size - 1) - y, c = relief.inradius_px;
            const double rest = 1 - u * u / (a * a) - v * v / (b * b);
            if (rest <= 0) continue;
            const double z = c * std::sqrt(rest);
            relief.mask(x, y) = 255;
            relief.depth_px(x, y) = static_cast<float>(z);
            relief.normals(x, y) =
                Vec3(u / (a * a), v / (b * b), z / (c * c)).normalized().cast<float>();
        }
    }
    return relief;
}

inline ViewLights key_and_back(const Relief& relief, double eta) {
    ViewLights lights;
    lights.lights.push_back({Vec3(-0.5, 0.55, 0.67).normalized(), Rgbd::Constant(1.0)});
    lights.lights.push_back({Vec3(0.75, 0.2, -0.63).normalized(), Rgbd::Constant(0.8)});
    lights.ambient = Rgbd::Constant(0.05);
    normalise_lights(lights, relief, eta);
    return lights;
}

/// Angle from `direction` to the nearest of the lights.
inline double nearest_deg(const ViewLights& lights, const Vec3& direction) {
    double best = 180;
    for (const ViewLight& light : lights.lights)
        best = std::min(best, degrees(angle_between(light.direction, direction)));
    return best;
}

/// Dipole profiles of three media, with `px_per_mm` pixels to the millimetre.
inline RadialProfile dipole_profile(const DipoleMedium (&per_mm)[3], double px_per_mm) {
    RadialProfile profile;
    profile.r.push_back(0);
    for (int i = 0; i < 300; ++i) profile.r.push_back(0.02 * std::pow(60 / 0.02, i / 299.0));
    for (double& r : profile.r) {
        Rgbd rd;
        for (int c = 0; c < 3; ++c) rd[c] = dipole_reflectance(per_mm[c], r);
        profile.rd.push_back(rd / (px_per_mm * px_per_mm));
        r *= px_per_mm;
    }
    return profile;
}

/// Apple of Jensen et al. 2001.
inline RadialProfile apple(double px_per_mm) {
    const DipoleMedium media[3] = {{2.29, 0.0030, 1.3}, {2.39, 0.0034, 1.3}, {1.97, 0.046, 1.3}};
    return dipole_profile(media, px_per_mm);
}

}  // namespace vitrine::testing_world
