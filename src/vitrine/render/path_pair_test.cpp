// A path of both scenes at once: bit by bit what each has when it is traced alone.
#include "geometry/primitives.h"
#include "render/path_tracer.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

Part make_part(const Mesh& mesh, const Material& material, bool is_virtual) {
    return {"part", std::make_shared<Mesh>(mesh), material, "", is_virtual};
}

/// A table, a real ball of glass and a mirror, a lamp with size, some light all around.
Scene world() {
    Scene scene;
    scene.parts.push_back(
        make_part(make_plane(1.0), Diffuse{Rgb(0.6f, 0.5f, 0.4f), {}, {}, false}, false));
    scene.parts.push_back(
        make_part(make_sphere(0.05, Vec3(0, 0, 0.055), 24), Dielectric{1.5, Rgb(3, 1, 2)}, false));
    scene.parts.push_back(make_part(make_box(Vec3(0.01, 0.1, 0.1), Vec3(-0.15, 0, 0.051)),
                                    Mirror{Rgb::Constant(0.9f)}, false));
    scene.lights.push_back(DiscLight{Vec3(0.2, 0.2, 0.5), Vec3(-0.4, -0.4, -0.82).normalized(),
                                     0.08, Rgb::Constant(1.0f)});
    scene.ambient_radiance = Rgb::Constant(0.05f);
    return scene;
}

bool same(const PathResult& a, const PathResult& b) {
    bool is_same = a.sees_virtual() == b.sees_virtual() && !a.soft() == !b.soft();
    if (is_same && a.soft()) {
        is_same = (a.soft()->shadow == b.soft()->shadow).all() &&
                  (a.soft()->diffuse == b.soft()->diffuse).all() &&
                  a.soft()->hit_distance == b.soft()->hit_distance;
    }
    for (std::size_t k = 0; k < kLayerCount; ++k) is_same &= (a.layer(k) == b.layer(k)).all();
    return is_same;
}

void expect_two_paths(const Material& material) {
    const Scene real = world();
    Scene whole = real;
    whole.parts.push_back(
        make_part(make_box(Vec3(0.05, 0.05, 0.05), Vec3(0.06, -0.08, 0.0255)), material, true));
    const RenderScene real_scene(real), whole_scene(whole);
    ASSERT_EQ(real_scene.epsilon(), whole_scene.epsilon());
    const PathTracer alone(real_scene, nullptr), both(whole_scene, nullptr);
    const Vec3f eye(0.1f, -0.45f, 0.3f);
    int touched = 0, hidden = 0, count = 0;
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 40; ++x) {
            const Vec3f place(-0.25f + 0.0125f * static_cast<float>(x),
                              -0.25f + 0.0125f * static_cast<float>(y), 0.01f);
            const Vec3f direction = (place - eye).normalized();
            const PathSampler sampler(stream_key(7, unsigned(x), unsigned(y)), 0);
            const PathTask task{sampler, {true, x % 3 == 0 ? 5 : 1}};
            const PathPair pair = both.trace_both(eye, direction, task);
            EXPECT_TRUE(same(pair.with(), both.trace(eye, direction, task)));
            EXPECT_TRUE(same(pair.without(), alone.trace(eye, direction, task)));
            EXPECT_TRUE(pair.is_touched() || same(pair.with(), pair.without()));
            touched += pair.is_touched() ? 1 : 0;
            hidden += pair.with().sees_virtual() ? 1 : 0;
            ++count;
        }
    }
    EXPECT_GT(hidden, count / 50);
    EXPECT_GT(touched, 2 * hidden);
    EXPECT_LT(touched, count);
}

TEST(PathPair, IsTwoPathsBehindADiffuseBox) {
    expect_two_paths(Diffuse{Rgb::Constant(0.7f), {}, {}, false});
}
TEST(PathPair, IsTwoPathsBehindAGlassBox) { expect_two_paths(Dielectric{1.4, Rgb::Constant(5)}); }
TEST(PathPair, IsTwoPathsBehindAMirror) { expect_two_paths(Mirror{Rgb::Constant(0.8f)}); }

TEST(PathPair, TogetherAsOneByOne) {
    Scene whole = world();
    whole.parts.push_back(make_part(make_box(Vec3(0.05, 0.05, 0.05), Vec3(0.06, -0.08, 0.0255)),
                                    Dielectric{1.4, Rgb::Constant(5)}, true));
    whole.lights.push_back(
        SpotLight{Vec3(-0.3, 0.1, 0.5), Vec3(0.5, -0.2, -0.8).normalized(), Rgb::Constant(2), 40});
    whole.lights.push_back(PointLight{Vec3(0.1, -0.3, 0.4), Rgb(0.1f, 0.2f, 0.3f)});
    const RenderScene scene(whole);
    const PathTracer tracer(scene, nullptr);
    const Vec3f eye(0.1f, -0.45f, 0.3f);
    PathTracer::Workspace workspace(tracer);
    std::vector<PathTask> tasks;
    std::vector<Vec3f> directions;
    for (int k = 0; k < 400; ++k) {
        const Vec3f place(-0.2f + 0.001f * static_cast<float>(k), 0.01f * float(k % 7), 0.05f);
        tasks.push_back({PathSampler(stream_key(9, unsigned(k)), 3), {k % 5 > 0, 1 + k % 3}});
        directions.push_back((place - eye).normalized());
    }
    std::vector<PathPair> together(tasks.size());
    const RayList rays = workspace.start(tasks.size());
    for (std::size_t i = 0; i < tasks.size(); ++i) {
        rays[i] = RayAndHit(eye, directions[i], kAllParts);
    }
    tracer.trace_both(tasks, together, workspace);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
        const PathPair alone = tracer.trace_both(eye, directions[i], tasks[i]);
        EXPECT_TRUE(same(together[i].with(), alone.with()));
        EXPECT_TRUE(same(together[i].without(), alone.without()));
        EXPECT_EQ(together[i].is_touched(), alone.is_touched());
    }
}

}  // namespace
}  // namespace vitrine
