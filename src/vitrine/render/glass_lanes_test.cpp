// Photons side by side at glass do bit by bit what each does alone.
#include "render/glass_lanes.h"

#include "base/rng.h"
#include "geometry/primitives.h"
#include "render/medium_table.h"
#include "render/packed_lanes.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

constexpr int kCount = 61;  // no multiple of a step

std::size_t lane(int i) { return static_cast<std::size_t>(i); }

Vec3f random_direction(Rng& rng) {
    return sample_uniform_sphere({rng.next_float(), rng.next_float()});
}

/// Rays of all angles that meet surfaces from within and without, some with the rounded normal
/// turned away, some of no optical effect.
struct Boundaries {
    PlainLanes surfaces = {};
    GlassLanes glass = {};

    explicit Boundaries(std::uint64_t seed) {
        Rng rng(seed);
        for (int i = 0; i < kCount; ++i) {
            const Vec3f direction = random_direction(rng);
            Vec3f flat = random_direction(rng);
            if (flat.dot(direction) > 0) flat = -flat;
            const float bend = i % 4 == 0 ? 0.9f : 0.1f;
            const Vec3f rounded = (flat + bend * random_direction(rng)).normalized();
            surfaces.direction.set(i, direction);
            surfaces.geometric.set(i, flat);
            surfaces.shading.set(i, rounded);
            surfaces.throughput.set(i, Rgb(0.2f, 0.5f, 0.1f) * rng.next_float());
            surfaces.u[lane(i)] = rng.next_float();
            surfaces.v[lane(i)] = rng.next_float();
            const float etas[] = {1.5f, 1 / 1.5f, 1.0f, 1 / 1.1f, 2.4f};
            glass.eta[lane(i)] = etas[i % 5];
            glass.initial[lane(i)] = 0.5f;
        }
        bend_lanes(surfaces, glass, kCount);
    }
    ShadingPoint point(int i) const {
        ShadingPoint point;
        point.geometric_normal = surfaces.geometric.at(i);
        point.shading_normal = surfaces.shading.at(i);
        return point;
    }
};

TEST(GlassLanes, RaysAreThoseOfOneAlone) {
    int odd = 0, total = 0;
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
        const Boundaries b(seed);
        for (int i = 0; i < kCount; ++i) {
            if (b.glass.eta[lane(i)] == 1) {
                EXPECT_EQ(b.glass.reflectance[lane(i)], 0);
                EXPECT_EQ(b.glass.refracted.at(i), b.surfaces.direction.at(i));
                continue;
            }
            const BentRays rays =
                bend(b.point(i), b.surfaces.direction.at(i), b.glass.eta[lane(i)]);
            EXPECT_EQ(b.glass.reflectance[lane(i)], rays.reflectance);
            EXPECT_EQ(b.glass.reflected.at(i), rays.reflected);
            if (rays.reflectance < 1) {
                EXPECT_EQ(b.glass.refracted.at(i), rays.refracted);
            }
            // Which side they leave for needs no look at them.
            EXPECT_GT(rays.reflected.dot(b.point(i).geometric_normal), 0);
            if (rays.reflectance < 1) {
                EXPECT_LT(rays.refracted.dot(b.point(i).geometric_normal), 0);
            }
            odd += b.glass.is_odd[lane(i)] ? 1 : 0;
            total += rays.reflectance == 1 ? 1 : 0;
        }
    }
    EXPECT_GT(odd, 10);
    EXPECT_LT(odd, 4 * kCount);
    EXPECT_GT(total, 20);
}

TEST(GlassLanes, NoPowerIsLost) {
    Boundaries b(3);
    branch_lanes(b.surfaces, b.glass, kCount);
    int both = 0;
    for (int i = 0; i < kCount; ++i) {
        float power = b.glass.chance[lane(i)];
        for (const BranchLanes* branch : {&b.glass.strong, &b.glass.faint}) {
            if (!branch->is_open[lane(i)]) continue;
            power += branch->power.at(i).sum();
        }
        EXPECT_NEAR(power, b.surfaces.throughput.at(i).sum(), 1e-6f);
        const float reflectance = b.glass.reflectance[lane(i)];
        if (reflectance > 0 && reflectance < 1) {
            EXPECT_NE(b.glass.strong.is_refracted[lane(i)] != 0, reflectance > 0.5f);
            EXPECT_NE(b.glass.faint.is_refracted[lane(i)] != 0, reflectance <= 0.5f);
        } else {
            EXPECT_TRUE(b.glass.strong.is_open[lane(i)]);
            EXPECT_FALSE(b.glass.faint.is_open[lane(i)]);
            EXPECT_EQ(b.glass.strong.is_refracted[lane(i)] != 0, reflectance == 0);
        }
        both += b.glass.strong.is_open[lane(i)] & b.glass.faint.is_open[lane(i)];
    }
    EXPECT_GT(both, 5);
}

// Over all random numbers each branch carries its share on average.
TEST(GlassLanes, ChanceChangesNoMean) {
    Boundaries b(5);
    Rng rng(6);
    constexpr int kDraws = 4000;
    std::vector<double> refracted(kCount, 0.0), reflected(kCount, 0.0);
    for (int draw = 0; draw < kDraws; ++draw) {
        for (int i = 0; i < kCount; ++i) {
            b.surfaces.u[lane(i)] = rng.next_float();
            b.surfaces.v[lane(i)] = rng.next_float();
        }
        branch_lanes(b.surfaces, b.glass, kCount);
        for (int i = 0; i < kCount; ++i) {
            for (const BranchLanes* branch : {&b.glass.strong, &b.glass.faint}) {
                if (!branch->is_open[lane(i)]) continue;
                auto& sum = branch->is_refracted[lane(i)] ? refracted : reflected;
                sum[lane(i)] += branch->power.y[lane(i)] / kDraws;
            }
        }
    }
    for (int i = 0; i < kCount; ++i) {
        // A branch survives with at least four times its share of 0.5: at most 0.125 of power each.
        const double power = b.surfaces.throughput.y[lane(i)];
        const double r = b.glass.reflectance[lane(i)];
        const auto bound = [&](double mean) { return 5 * std::sqrt(0.125 * mean / kDraws) + 1e-5; };
        EXPECT_NEAR(reflected[lane(i)], r * power, bound(r * power));
        EXPECT_NEAR(refracted[lane(i)], (1 - r) * power, bound((1 - r) * power));
    }
}

TEST(PackedLanes, DirectionsArePackedAsOneAlone) {
    Rng rng(2);
    for (const float sign : {1.0f, -1.0f}) {
        Lanes3 unit = {};
        for (int i = 0; i < kCount; ++i) unit.set(i, random_direction(rng));
        for (int axis = 0; axis < 3; ++axis) unit.set(axis, Vec3f::Unit(axis));
        for (int axis = 0; axis < 3; ++axis) unit.set(3 + axis, -Vec3f::Unit(axis));
        PackedLanes packed;
        pack_directions(unit, sign, packed, kCount);
        for (int i = 0; i < kCount; ++i) {
            const PackedDirection expected(sign * unit.at(i));
            EXPECT_EQ(packed.at(i).x, expected.x);
            EXPECT_EQ(packed.at(i).y, expected.y);
        }
    }
}

// Any walk through nested, touching and open bodies finds the media that `cross_boundary` finds.
TEST(MediumTable, WalksAreThoseOfTheMedia) {
    Scene scene;
    for (const double ior : {1.5, 1.33, 1.5, 1.0}) {
        const Mesh mesh = make_sphere(0.1 + 0.02 * double(scene.parts.size()), Vec3::Zero(), 6);
        const Rgb absorption = Rgb::Constant(scene.parts.size() == 1 ? 3.0f : 0.0f);
        scene.parts.push_back(
            {"part", std::make_shared<Mesh>(mesh), Dielectric{ior, absorption}, "", false});
    }
    const RenderScene prepared(scene);
    MediumTable table(prepared);
    Rng rng(9);
    for (int walk = 0; walk < 20; ++walk) {
        Media media;
        std::uint32_t medium = 0;
        for (int k = 0; k < 30; ++k) {
            const int part = static_cast<int>(rng.next_index(4));
            const bool is_front = rng.next_float() < 0.5f;
            const Boundary boundary = cross_boundary(prepared, part, is_front, media);
            const MediumTable::Crossing crossing = table.cross(medium, part, is_front);
            EXPECT_EQ(crossing.eta, boundary.eta);
            media = boundary.beyond;
            medium = crossing.beyond;
            EXPECT_TRUE(table.media(medium) == media);
            EXPECT_EQ(table.absorbs(medium), media.current() == 1);
        }
    }
}

}  // namespace
}  // namespace vitrine
