#include "compose/composite.h"

#include "geometry/primitives.h"
#include "image/image_io.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

// The composite over the rendered plate is the rendered scene with the object, at silhouettes too.
TEST(Composite, OverTheRenderedPlateGivesTheRenderedPicture) {
    Scene real;
    const auto add = [](std::vector<Part>& parts, const Mesh& mesh, const Material& material) {
        parts.push_back({"p", std::make_shared<Mesh>(mesh), material, "", false});
    };
    add(real.parts, make_plane(1.0), Diffuse{Rgb(0.6f, 0.5f, 0.4f), {}, {}, false});
    add(real.parts, make_sphere(0.05, Vec3(0, 0, 0.05)), Dielectric{1.5, Rgb(3, 1, 2)});
    real.lights.push_back(DiscLight{Vec3(0.4, 0.3, 0.7), Vec3(-0.4, -0.3, -0.7).normalized(), 0.05,
                                    Rgb::Constant(3.0f)});
    real.ambient_radiance = Rgb::Constant(0.05f);
    std::vector<Part> virtual_parts;
    add(virtual_parts, make_box(Vec3(0.05, 0.05, 0.05), Vec3(-0.08, -0.03, 0.025)),
        Diffuse{Rgb::Constant(0.8f), {}, {}, false});
    Camera camera{"0", 48, 32, 60, 60, 23.5, 15.5, {}};
    camera.cam_from_world =
        look_at(Vec3(0.1, -0.45, 0.35), Vec3(-0.02, 0, 0.03), Vec3(0, 0, 1)).inverse();
    DifferentialOptions options;
    options.photon_count = 20000;
    options.max_samples = 32;
    const DifferentialRenderer renderer(real, virtual_parts, {&camera, 1}, options);
    const DifferentialImage image = renderer.render(camera);
    const ImageRgb picture = composite(image.without, image);
    int unchanged = 0, partly = 0;
    for (std::size_t i = 0; i < picture.size(); ++i) {
        // At silhouettes the plate stands for the uncovered share alone, up to what varies within
        // the pixel.
        const float a = image.coverage[i];
        partly += a > 0 && a < 1;
        if (a == 0) {
            EXPECT_LT((picture[i] - image.with[i]).abs().maxCoeff(),
                      1e-5f * (1 + picture[i].maxCoeff()));
        }
        if (a == 1) {
            EXPECT_LT((picture[i] - image.with[i]).abs().maxCoeff(), 1e-5f);
            EXPECT_EQ(image.delta()[i].abs().maxCoeff(), 0.0f);
        }
        unchanged += (image.delta()[i] == 0).all() && a == 0;
    }
    EXPECT_GT(unchanged, 5);
    EXPECT_GT(partly, 10);

    const auto path = std::filesystem::temp_directory_path() / "vitrine_composite_test.exr";
    write_composite_exr(path, image.without, image, camera);
    const ExrImage exr = read_exr(path);
    std::filesystem::remove(path);
    for (const char* name :
         {"R", "A", "object.A", "delta.G", "shadow.R", "caustics.R", "reflection.B", "refraction.R",
          "diffuse.G", "Z", "normal.X", "albedo.R"}) {
        EXPECT_TRUE(exr.channels.contains(name)) << name;
    }
    const ImageF &a = exr.channels.at("object.A"), &g = exr.channels.at("G");
    for (std::size_t i = 0; i < picture.size(); ++i) {
        const float expected = (1 - a[i]) * (image.without[i][1] + exr.channels.at("delta.G")[i]) +
                               exr.channels.at("object.G")[i];
        EXPECT_NEAR(g[i], expected, 1e-3f * std::max(1.0f, g[i]));
    }
}

}  // namespace
}  // namespace vitrine
