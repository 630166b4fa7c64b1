#include "pipeline/placement.h"

#include "base/error.h"
#include "geometry/mesh_io.h"
#include "geometry/primitives.h"

#include <gtest/gtest.h>

#include <unistd.h>

namespace vitrine {
namespace {

TEST(Placement, StandsOnTheTableWhereThePixelShowsIt) {
    const auto file = std::filesystem::temp_directory_path() /
                      ("vitrine_placement_" + std::to_string(::getpid()) + ".ply");
    write_ply(file, make_box(Vec3(0.1, 0.1, 0.2), Vec3(5, 5, 5)));
    Scene scene;
    scene.parts.push_back({"table", std::make_shared<Mesh>(make_plane(2)), Diffuse{}, "", false});
    scene.cameras.push_back({"a_b", 64, 48, 60, 60, 31.5, 23.5,
                             look_at(Vec3(0.5, -0.5, 0.7), Vec3::Zero(), Vec3(0, 0, 1)).inverse()});
    const Placement placement = parse_placement("a_b,40,30");
    EXPECT_EQ(placement.frame, "a_b");
    const Insertion insertion = place_on_surface(file, placement, scene, Vec3(0, 0, 1));
    const Box3 box = bounds(*insertion.objects[0].mesh);
    EXPECT_NEAR(box.min.z(), 0.0, 1e-6);
    EXPECT_NEAR(box.size().z(), 0.2, 1e-6);
    const Vec3 foot(box.centre().x(), box.centre().y(), 0);
    EXPECT_LT((scene.cameras[0].project(foot) - Vec2(40, 30)).norm(), 1e-3);
    EXPECT_THROW(place_on_surface(file, {"nope", Vec2(1, 1)}, scene, Vec3(0, 0, 1)), InputError);
    EXPECT_THROW(place_on_surface(file, {"a_b", Vec2(99, 1)}, scene, Vec3(0, 0, 1)), InputError);
    EXPECT_THROW(parse_placement("000003;1;2"), UsageError);
    std::filesystem::remove(file);
}

}  // namespace
}  // namespace vitrine
