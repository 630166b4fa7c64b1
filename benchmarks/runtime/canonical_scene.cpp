#include "canonical_scene.h"

#include "geometry/primitives.h"

namespace vitrine {
namespace {

Part make_part(const char* name, Mesh mesh, const Material& material) {
    return {name, std::make_shared<const Mesh>(std::move(mesh)), material, "", false};
}

}  // namespace

Scene canonical_scene(int sphere_triangles) {
    Scene scene;
    // A sphere of n rings has 4 n (n - 1) triangles.
    const int rings = static_cast<int>(std::ceil(0.5 * (1.0 + std::sqrt(1.0 + sphere_triangles))));
    scene.parts.push_back(
        make_part("table", make_plane(1.2), Diffuse{Rgb::Constant(0.6f), {}, {}, false}));
    scene.parts.push_back(make_part("box", make_box(Vec3(0.1, 0.1, 0.1), Vec3(0.2, 0.15, 0.05)),
                                    Diffuse{Rgb(0.6f, 0.1f, 0.1f), {}, {}, false}));
    scene.parts.push_back(make_part("sphere", make_sphere(0.06, Vec3(0, 0, 0.061), rings),
                                    Dielectric{1.5, Rgb::Zero()}));
    scene.lights.push_back(PointLight{Vec3(0.55, -0.45, 0.8), Rgb::Constant(1.0f)});
    for (int i = 0; i < 4; ++i) {
        const double angle = 0.5 * kPi * i;
        const Vec3 eye(0.9 * std::sin(angle), -0.9 * std::cos(angle), 0.6);
        // Its pixel centres lie at half integers: shifted by half a pixel here.
        Camera camera{std::to_string(i), 640,   360,   553.9830366915456,
                      553.9830366915456, 319.5, 179.5, {}};
        camera.cam_from_world = look_at(eye, Vec3::Zero(), Vec3(0, 0, 1)).inverse();
        scene.cameras.push_back(camera);
    }
    return scene;
}

}  // namespace vitrine
