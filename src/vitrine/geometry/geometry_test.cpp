#include "base/error.h"
#include "base/file.h"
#include "base/rng.h"
#include "base/scratch_folder.h"
#include "geometry/camera.h"
#include "geometry/even_samples.h"
#include "geometry/mesh.h"
#include "geometry/mesh_io.h"
#include "geometry/plane.h"
#include "geometry/point_grid.h"
#include "geometry/primitives.h"
#include "geometry/scalar_grid.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

TEST(Camera, ProjectAndUnprojectAgree) {
    Camera camera{
        "a", 640,   360,   520,
        520, 319.5, 179.5, look_at(Vec3(0.4, -0.5, 0.6), Vec3::Zero(), Vec3(0, 0, 1)).inverse()};
    const Vec3 p(0.05, 0.02, 0.01);
    const Vec2 pixel = camera.project(p);
    EXPECT_LT((camera.unproject(pixel.x(), pixel.y(), camera.depth(p)) - p).norm(), 1e-12);
    const Vec2 half = camera.scaled(0.5).project(p);
    EXPECT_NEAR((half.x() + 0.5) * 2 - 0.5, pixel.x(), 1e-9);
    EXPECT_LT(
        (camera.ray_in_world(pixel.x(), pixel.y()) - (p - camera.centre_in_world()).normalized())
            .norm(),
        1e-12);
}

TEST(Primitives, ClosedOutwardAndRightSize) {
    const Mesh sphere = make_sphere(0.05, Vec3(1, 2, 3), 64);
    EXPECT_TRUE(find_defects(sphere).is_closed());
    EXPECT_NEAR(volume(sphere), 4.0 / 3 * kPi * 0.05 * 0.05 * 0.05, 1e-6);
    const Mesh torus = make_torus(0.05, 0.02, Vec3::Zero());
    EXPECT_TRUE(find_defects(torus).is_closed());
    EXPECT_NEAR(volume(torus), 2 * kPi * kPi * 0.05 * 0.0004, 2e-6);
    const Mesh box = make_box(Vec3(1, 2, 3));
    EXPECT_TRUE(find_defects(box).is_closed());
    EXPECT_NEAR(volume(box), 6, 1e-6);
    EXPECT_NEAR(surface_area(box), 22, 1e-5);
    const Mesh cylinder = make_cylinder(0.1, 0.3, Vec3(0, 0, 1));
    EXPECT_TRUE(find_defects(cylinder).is_closed());
    EXPECT_NEAR(volume(cylinder), kPi * 0.01 * 0.3, 2e-5);
    EXPECT_GT(triangle_normal(make_plane(1), 0).z(), 0.99f);
}

TEST(Mesh, NormalsCreasesAndComponents) {
    const Mesh sphere = make_sphere(1, Vec3::Zero(), 32);
    const std::vector<Vec3f> normals = vertex_normals(sphere);
    for (std::size_t i = 0; i < normals.size(); ++i) {
        EXPECT_GT(normals[i].dot(sphere.vertices[i]), 0.999f);
    }
    const Mesh box = with_creased_normals(welded(make_box(Vec3(1, 1, 1)), 1e-6), 30);
    EXPECT_EQ(box.vertices.size(), 24u);
    Mesh two = make_box(Vec3(1, 1, 1));
    two = welded(two, 1e-6);
    append(two, welded(make_box(Vec3(1, 1, 1), Vec3(5, 0, 0)), 1e-6));
    const std::vector<int> components = triangle_components(two);
    EXPECT_EQ(*std::max_element(components.begin(), components.end()), 1);
    Mesh open = make_box(Vec3(1, 1, 1));
    open.triangles.pop_back();
    EXPECT_EQ(find_defects(open).boundary_edges, 3u);
}

class MeshIo : public testing::Test {
  protected:
    ScratchFolder folder_{"mesh_io"};
};

TEST_F(MeshIo, PlyRoundTripKeepsEverything) {
    Mesh mesh = make_plane(1, 0.25, 2);
    mesh.colours.assign(mesh.vertices.size(), Rgb(0.1f, 0.2f, 0.3f));
    write_ply(folder_ / "a.ply", mesh);
    const Mesh back = read_mesh(folder_ / "a.ply");
    EXPECT_EQ(back.vertices, mesh.vertices);
    EXPECT_EQ(back.triangles, mesh.triangles);
    EXPECT_EQ(back.normals, mesh.normals);
    EXPECT_EQ(back.uv, mesh.uv);
    EXPECT_TRUE((back.colours[3] == mesh.colours[3]).all());
}

TEST_F(MeshIo, AsciiPlyAndObjPolygons) {
    write_text_file(folder_ / "q.ply",
                    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                    "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                    "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    EXPECT_EQ(read_mesh(folder_ / "q.ply").triangles.size(), 2u);
    write_text_file(folder_ / "q.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
    EXPECT_NEAR(surface_area(read_mesh(folder_ / "q.obj")), 1.0, 1e-6);
}

TEST_F(MeshIo, LiesAreRefused) {
    write_text_file(folder_ / "a.ply",
                    "ply\nformat ascii 1.0\nelement vertex 4294967295\nproperty float x\n"
                    "property float y\nproperty float z\nend_header\n0 0 0\n");
    EXPECT_THROW(read_mesh(folder_ / "a.ply"), InputError);
    write_text_file(folder_ / "b.ply",
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                    "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                    "end_header\n0 0 0\n3 0 1 2\n");
    EXPECT_THROW(read_mesh(folder_ / "b.ply"), InputError);
    write_text_file(folder_ / "c.obj", "v 0 0 0\nf 1 2 3\n");
    EXPECT_THROW(read_mesh(folder_ / "c.obj"), InputError);
    EXPECT_THROW(read_mesh(folder_ / "d.stl"), InputError);
}

TEST(ScalarGrid, SurfaceOfABallIsClosedAndInPlace) {
    Box3 box;
    box.extend(Vec3(-0.06, -0.06, -0.06));
    box.extend(Vec3(0.06, 0.06, 0.06));
    ScalarGrid grid(box, 0.004, 0.0f);
    for (std::size_t i = 0; i < grid.values.size(); ++i) {
        const Eigen::Vector3i c = grid.node_of(i);
        grid.values[i] = static_cast<float>(grid.node(c.x(), c.y(), c.z()).norm() - 0.05);
    }
    EXPECT_NEAR(grid.sample(Vec3(0.031, 0.002, -0.013)), 0.0337 - 0.05, 5e-4);
    const Mesh mesh = zero_surface(grid);
    EXPECT_TRUE(find_defects(mesh).is_closed());
    EXPECT_NEAR(volume(mesh), 4.0 / 3 * kPi * std::pow(0.05, 3), 0.01 * volume(mesh));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        EXPECT_NEAR(mesh.vertices[i].norm(), 0.05f, 4e-4f);
        EXPECT_GT(mesh.normals[i].dot(mesh.vertices[i].normalized()), 0.99f);
    }
}

TEST(EvenSamples, NoTwoAreNearAndPatchesCoverTheSurface) {
    const Mesh torus = make_torus(0.05, 0.02, Vec3::Zero());
    const double spacing = 0.003, area = surface_area(torus);
    const EvenSamples samples = sample_evenly(torus, spacing, 1);
    EXPECT_NEAR(samples.size() * spacing * spacing / area, 1.0, 0.1);
    double sum = 0;
    for (const float a : samples.area_m2) {
        sum += a;
        EXPECT_GT(a, 0.0f);
        EXPECT_LT(a, 3 * spacing * spacing);
    }
    EXPECT_NEAR(sum, area, 1e-5 * area);
    const PointGrid grid(samples.points, static_cast<float>(spacing));
    for (std::size_t i = 0; i < samples.size(); ++i) {
        int near = 0;
        grid.for_each_near(samples.points[i], [&](std::uint32_t k) {
            near += (samples.points[k] - samples.points[i]).norm() < 0.76f * spacing;
        });
        EXPECT_EQ(near, 1);  // itself
    }
}

TEST(EvenSamples, BothSidesOfAThinSheetGetTheirOwn) {
    const Mesh sheet = make_box(Vec3(0.1, 0.1, 1e-4));
    const EvenSamples samples = sample_evenly(sheet, 0.005, 1);
    double top = 0, bottom = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (samples.normals[i].z() > 0.5f) top += samples.area_m2[i];
        if (samples.normals[i].z() < -0.5f) bottom += samples.area_m2[i];
    }
    EXPECT_NEAR(top, 0.01, 1e-4);
    EXPECT_NEAR(bottom, 0.01, 1e-4);
}

TEST(Plane, FitIgnoresWhatStandsOnIt) {
    std::vector<Vec3> points;
    Rng rng(9);
    const Vec3 normal = Vec3(0.1, -0.2, 1).normalized();
    for (int i = 0; i < 3000; ++i) {
        const auto u = [&] { return 2 * rng.next_double() - 1; };
        Vec3 p(u(), u(), u());
        p -= (normal.dot(p) - 0.3 - 1e-3 * u()) * normal;
        if (i % 3 == 0) p += 0.5 * (0.1 + rng.next_double()) * normal;
        points.push_back(p);
    }
    const PlaneFit fit = fit_plane(points, 0.01);
    const double sign = fit.plane.normal.dot(normal) > 0 ? 1 : -1;
    EXPECT_LT(angle_between(sign * fit.plane.normal, normal), 1e-3);
    EXPECT_NEAR(sign * fit.plane.offset_m, 0.3, 3e-4);
    EXPECT_GE(fit.inliers, 2000u);
    EXPECT_EQ(fit_plane({}, 0.01).inliers, 0u);
}

}  // namespace
}  // namespace vitrine
