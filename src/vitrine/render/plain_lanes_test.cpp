// Points side by side have bit by bit what each has alone.
#include "render/plain_lanes.h"

#include "geometry/primitives.h"
#include "render/path_tracer.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

constexpr int kCount = 61;  // no multiple of a step

std::size_t lane(int i) { return static_cast<std::size_t>(i); }

/// A ball with normals, a box without, lamps of all kinds.
Scene scene_of_two() {
    Scene scene;
    Mesh ball = make_sphere(0.1, Vec3(0, 0, 0.1), 12);
    ball.normals = vertex_normals(ball);
    Mesh box = make_box(Vec3(0.1, 0.1, 0.1), Vec3(0.15, 0, 0.05));
    box.normals.clear();
    for (const Mesh& mesh : {ball, box}) {
        scene.parts.push_back({"part", std::make_shared<Mesh>(mesh),
                               Diffuse{Rgb(0.6f, 0.5f, 0.4f), {}, {}, false}, "", false});
    }
    scene.lights.push_back(DiscLight{Vec3(0.2, 0.3, 0.7), Vec3(-0.2, -0.3, -0.7).normalized(), 0.1,
                                     Rgb(1.0f, 2.0f, 3.0f)});
    scene.lights.push_back(PointLight{Vec3(-0.3, 0.2, 0.4), Rgb(3.0f, 2.0f, 1.0f)});
    return scene;
}

PathSampler sampler_of(int i) { return {stream_key(5, unsigned(i)), unsigned(3 * i)}; }

/// Hits of rays from all around, some from within.
struct Points {
    RenderScene scene;
    std::vector<Hit> hits;
    std::vector<Vec3f> directions;
    PlainLanes lanes = {};

    explicit Points(const Scene& of = scene_of_two()) : scene(of) {
        Rng random(3);
        while (hits.size() < kCount) {
            const Vec3f outside(random.next_float() - 0.5f, random.next_float() - 0.5f,
                                0.3f * random.next_float());
            const Vec3f from = hits.size() % 6 == 0 ? Vec3f(0.15f, 0, 0.05f) : outside;
            const Vec3f to(0.3f * random.next_float() - 0.1f, 0.1f * random.next_float() - 0.05f,
                           0.15f * random.next_float());
            const Vec3f direction = (to - from).normalized();
            const Hit hit = scene.closest({from, direction, 0.0f, 1e30f, kAllParts});
            if (!hit.is_hit()) continue;
            hits.push_back(hit);
            directions.push_back(direction);
        }
        for (int i = 0; i < kCount; ++i) {
            const Hit& hit = hits[lane(i)];
            const PartShape& shape = scene.shape(hit.part);
            set_hit(lanes, i, shape, hit, directions[lane(i)]);
            lanes.albedo.set(i, Rgb(0.6f, 0.5f, 0.4f));
            lanes.throughput.set(i, Rgb(0.9f, 0.8f, 0.7f));
            lanes.can_scatter[lane(i)] = i % 3 == 0 ? 0 : 1;
            lanes.scale[lane(i)] = 0.5f;
            lanes.random.stream[lane(i)] = sampler_of(i).mixed_stream();
            lanes.random.index[lane(i)] = sampler_of(i).index();
            lanes.random.depth[lane(i)] = static_cast<std::uint32_t>(i % 6);
            lanes.random.use[lane(i)] = static_cast<std::uint32_t>(2 + i % 9);
            lanes.random.of[lane(i)] = static_cast<std::uint32_t>(1 + i % 4);
        }
        find_surfaces(lanes, kCount);
        find_origins(lanes, scene.epsilon(), kCount);
    }
    ShadingPoint point(int i) const { return scene.surface(hits[lane(i)], directions[lane(i)]); }
};

TEST(PlainLanes, SurfacesAreThoseOfTheScene) {
    const Points points;
    int inner = 0, rounded = 0;
    for (int i = 0; i < kCount; ++i) {
        const ShadingPoint point = points.point(i);
        EXPECT_EQ(points.lanes.position.at(i), point.position);
        EXPECT_EQ(points.lanes.geometric.at(i), point.geometric_normal);
        EXPECT_EQ(points.lanes.shading.at(i), point.shading_normal);
        EXPECT_EQ(points.lanes.smooth.at(i), point.smooth_position);
        EXPECT_EQ(points.lanes.origin.at(i), points.scene.leave_smooth(point));
        inner += point.is_front ? 0 : 1;
        rounded += points.lanes.is_rounded[lane(i)] ? 1 : 0;
    }
    EXPECT_GT(inner, 3);
    EXPECT_GT(rounded, 10);
    EXPECT_LT(rounded, kCount - 10);
}

TEST(PlainLanes, FlatSurfacesAreThoseOfTheSceneAlsoAmongThemselves) {
    Scene scene = scene_of_two();
    for (Part& part : scene.parts) {
        Mesh flat = *part.mesh;
        flat.normals.clear();
        part.mesh = std::make_shared<Mesh>(std::move(flat));
    }
    const Points points(scene);
    for (int i = 0; i < kCount; ++i) {
        const ShadingPoint point = points.point(i);
        EXPECT_EQ(points.lanes.position.at(i), point.position);
        EXPECT_EQ(points.lanes.shading.at(i), point.shading_normal);
        EXPECT_EQ(points.lanes.smooth.at(i), point.smooth_position);
        EXPECT_EQ(points.lanes.origin.at(i), points.scene.leave_smooth(point));
    }
}

TEST(PlainLanes, NormalsOfTheFacetsRoundNothing) {
    Scene scene = scene_of_two();
    scene.parts[1].mesh =
        std::make_shared<Mesh>(make_box(Vec3(0.1, 0.1, 0.1), Vec3(0.15, 0, 0.05)));
    ASSERT_FALSE(scene.parts[1].mesh->normals.empty());
    const RenderScene ready(scene);
    EXPECT_TRUE(ready.shape(0).normals);
    EXPECT_FALSE(ready.shape(1).normals);
}

TEST(PlainLanes, RandomPairsAreThoseOfTheSampler) {
    Points points;
    PlainLanes& lanes = points.lanes;
    for (std::uint32_t k = 0; k < 3; ++k) {
        random_pairs(lanes.random, k, lanes.u, lanes.v, kCount);
        for (int i = 0; i < kCount; ++i) {
            const Vec2f pair = sampler_of(i).pair(i % 6, 2 + i % 9, 1 + i % 4, int(k));
            EXPECT_EQ(lanes.u[lane(i)], pair.x());
            EXPECT_EQ(lanes.v[lane(i)], pair.y());
        }
    }
}

TEST(PlainLanes, LightsAreThoseOfTheSampler) {
    Points points;
    PlainLanes& lanes = points.lanes;
    const LightSampler& lights = points.scene.lights();
    const auto known = lane_lights(lights);
    random_pairs(lanes.random, 0, lanes.u, lanes.v, kCount);
    int lit = 0;
    for (std::size_t light = 0; light < lights.count(); ++light) {
        sample_light(lanes, *known[light], kCount);
        const PlainLanes sampled = lanes;
        receive_light(lanes, kCount);
        for (int i = 0; i < kCount; ++i) {
            const ShadingPoint point = points.point(i);
            const auto s = lights.sample(light, points.scene.leave_smooth(point),
                                         {lanes.u[lane(i)], lanes.v[lane(i)]});
            ASSERT_EQ(s.has_value(), sampled.lit[lane(i)] > 0);
            if (!s) continue;
            EXPECT_EQ(sampled.to_light.at(i), s->direction);
            EXPECT_EQ(sampled.distance[lane(i)], s->distance);
            EXPECT_EQ(sampled.pdf[lane(i)], s->pdf);
            EXPECT_TRUE((sampled.light.at(i).array() == s->radiance_over_pdf).all());
            const float cosine = s->direction.dot(point.shading_normal);
            const bool is_lit = cosine > 0 && s->direction.dot(point.geometric_normal) > 0;
            ASSERT_EQ(is_lit, lanes.lit[lane(i)] > 0);
            if (!is_lit) continue;
            ++lit;
            const float lobe = cosine / kPif;
            const float weight = s->pdf > 0 && i % 3 != 0 ? s->pdf / (s->pdf + lobe) : 1.0f;
            const Rgb expected = Rgb(0.9f, 0.8f, 0.7f) * Rgb(0.6f, 0.5f, 0.4f) / kPif * weight *
                                 s->radiance_over_pdf * (0.5f * cosine);
            EXPECT_TRUE(lanes.light.at(i).isApprox(expected.matrix(), 1e-6f));
        }
    }
    EXPECT_GT(lit, 20);
}

TEST(PlainLanes, ScattersAsTheMaterial) {
    Points points;
    PlainLanes& lanes = points.lanes;
    random_pairs(lanes.random, 0, lanes.u, lanes.v, kCount);
    scatter_lanes(lanes, kCount);
    int open = 0;
    for (int i = 0; i < kCount; ++i) {
        const ShadingPoint point = points.point(i);
        const BsdfSample s = sample(DiffuseBsdf{Rgb(0.6f, 0.5f, 0.4f)}, Vec3f(0, 0, 1),
                                    {lanes.u[lane(i)], lanes.v[lane(i)]}, 0.0f);
        const Vec3f direction = Frame(point.shading_normal).to_world(s.wi);
        EXPECT_EQ(lanes.scattered.at(i), direction);
        EXPECT_EQ(lanes.scattered_pdf[lane(i)], s.pdf);
        EXPECT_EQ(lanes.open[lane(i)] > 0, direction.dot(point.geometric_normal) > 0);
        open += lanes.open[lane(i)] > 0 ? 1 : 0;
    }
    EXPECT_GT(open, kCount / 2);
}

}  // namespace
}  // namespace vitrine
