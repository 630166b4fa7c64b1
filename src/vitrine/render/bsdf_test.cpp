#include "render/bsdf.h"

#include "base/rng.h"
#include "math/rigid3.h"
#include "math/sampling.h"
#include "math/statistics.h"
#include "render/light_sampler.h"
#include "render/sampler.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

struct Case {
    std::string name;
    Bsdf bsdf;
};

std::vector<Case> rough_materials() {
    return {{"diffuse", DiffuseBsdf{Rgb(0.8f, 0.5f, 0.2f)}},
            {"ward", WardBsdf{Rgb::Constant(0.3f), Rgb::Constant(0.3f), 0.25f, 0.25f, false}},
            {"duer", WardBsdf{Rgb::Constant(0.1f), Rgb::Constant(0.5f), 0.15f, 0.15f, true}},
            {"anisotropic", WardBsdf{Rgb::Constant(0.2f), Rgb::Constant(0.4f), 0.1f, 0.4f, false}},
            {"translucent", TranslucentBsdf{Rgb(0.6f, 0.4f, 0.2f), 1.4f, 0.0f}},
            {"glossy translucent", TranslucentBsdf{Rgb(0.6f, 0.4f, 0.2f), 1.5f, 0.2f}}};
}

const Vec3f kViews[] = {Vec3f(0, 0, 1), Vec3f(0.5f, 0.2f, 0.8f).normalized(),
                        Vec3f(-0.8f, 0.3f, 0.4f).normalized()};

constexpr int kRows = 20, kColumns = 40;

int cell_of(const Vec3f& d) {
    const int row = std::min(kRows - 1, static_cast<int>(d.z() * kRows));
    const float phi = std::atan2(d.y(), d.x()) + kPif;
    return row * kColumns + std::min(kColumns - 1, static_cast<int>(phi / (2 * kPif) * kColumns));
}

// Pearson's test of the drawn directions against the density, integrated over each cell; samples
// that end below the horizon are the share missing from one.
TEST(Bsdf, SamplesFollowTheirDensity) {
    constexpr int kDraws = 100000, kSub = 24;
    int tests = 0;
    for (const Case& c : rough_materials()) {
        for (const Vec3f& wo : kViews) {
            std::vector<double> observed(kRows * kColumns + 1, 0.0), expected(observed.size(), 0.0);
            Rng rng(stream_key(7, ++tests));
            for (int i = 0; i < kDraws; ++i) {
                const Vec2f u(rng.next_float(), rng.next_float());
                const BsdfSample s = sample(c.bsdf, wo, u, rng.next_float());
                observed[s.pdf > 0 ? static_cast<std::size_t>(cell_of(s.wi)) : kRows * kColumns] +=
                    1;
            }
            double sum = 0;
            for (int r = 0; r < kRows * kSub; ++r) {
                const float z = (static_cast<float>(r) + 0.5f) / (kRows * kSub);
                for (int k = 0; k < kColumns * kSub; ++k) {
                    const float phi =
                        2 * kPif * (static_cast<float>(k) + 0.5f) / (kColumns * kSub) - kPif;
                    const float rho = std::sqrt(1 - z * z);
                    const double mass =
                        pdf(c.bsdf, wo, Vec3f(rho * std::cos(phi), rho * std::sin(phi), z)) * 2 *
                        kPi / (double(kRows) * kColumns * kSub * kSub);
                    expected[static_cast<std::size_t>(r / kSub * kColumns + k / kSub)] +=
                        mass * kDraws;
                    sum += mass;
                }
            }
            EXPECT_LT(sum, 1.005) << c.name;
            expected.back() = std::max(0.0, 1 - sum) * kDraws;
            // The remainder is known to the error of the integral only: leave it out when tiny.
            if (expected.back() < 0.005 * kDraws) {
                observed.pop_back();
                expected.pop_back();
            }
            EXPECT_GT(chi_square_test(observed, expected).p_value, sidak(0.01, 18)) << c.name;
        }
    }
}

TEST(Bsdf, ReciprocalAndKeepsEnergy) {
    for (const Case& c : rough_materials()) {
        for (const Vec3f& wo : kViews) {
            Rng rng(3);
            Rgbd albedo = Rgbd::Zero();
            constexpr int kDraws = 20000;
            for (int i = 0; i < kDraws; ++i) {
                const Vec2f u(rng.next_float(), rng.next_float());
                const BsdfSample s = sample(c.bsdf, wo, u, rng.next_float());
                if (s.pdf <= 0) continue;
                albedo += s.weight.cast<double>() / kDraws;
                const Rgb there = eval(c.bsdf, wo, s.wi), back = eval(c.bsdf, s.wi, wo);
                EXPECT_LE((there - back).abs().maxCoeff(), 1e-4f * (there.maxCoeff() + 1e-3f));
            }
            EXPECT_LT(albedo.maxCoeff(), 1.02) << c.name;
        }
    }
}

TEST(Bsdf, DielectricSplitsByFresnel) {
    int transmitted = 0;
    constexpr int kDraws = 100000;
    for (int i = 0; i < kDraws; ++i) {
        const float u = (static_cast<float>(i) + 0.5f) / kDraws;
        const BsdfSample s = sample(DielectricBsdf{1.5f}, Vec3f(0, 0, 1), Vec2f(0.5f, 0.5f), u);
        transmitted += s.is_transmitted;
        if (s.is_transmitted) {
            EXPECT_NEAR(s.weight[0], 1 / 2.25f, 1e-5f);
        }
    }
    EXPECT_NEAR(transmitted / double(kDraws), 0.96, 1e-4);
}

// A ray and its reverse: the same share is reflected, and the compressions of radiance cancel.
TEST(Bsdf, DielectricIsReciprocalAndKeepsEnergy) {
    for (const float eta : {1.33f, 1.5f, 2.4f}) {
        for (const Vec3f& wo : kViews) {
            const BsdfSample in = sample(DielectricBsdf{eta}, wo, Vec2f(0.5f, 0.5f), 0.999f);
            ASSERT_TRUE(in.is_transmitted);
            // Back from inside: up is the side of the ray.
            const Vec3f back(in.wi.x(), in.wi.y(), -in.wi.z());
            int reflected_in = 0, reflected_back = 0;
            constexpr int kDraws = 20000;
            float weight_back = 0;
            for (int i = 0; i < kDraws; ++i) {
                const float u = (static_cast<float>(i) + 0.5f) / kDraws;
                reflected_in +=
                    !sample(DielectricBsdf{eta}, wo, Vec2f(0.5f, 0.5f), u).is_transmitted;
                const BsdfSample out = sample(DielectricBsdf{1 / eta}, back, Vec2f(0.5f, 0.5f), u);
                reflected_back += !out.is_transmitted;
                if (out.is_transmitted) weight_back = out.weight[0];
            }
            EXPECT_NEAR(reflected_in, reflected_back, 2);
            EXPECT_NEAR(weight_back * in.weight[0], 1.0f, 1e-5f);
        }
    }
    const BsdfSample mirror =
        sample(MirrorBsdf{Rgb(0.9f, 0.8f, 0.7f)}, kViews[1], Vec2f(0.5f, 0.5f), 0.5f);
    const BsdfSample reverse =
        sample(MirrorBsdf{Rgb(0.9f, 0.8f, 0.7f)}, mirror.wi, Vec2f(0.5f, 0.5f), 0.5f);
    EXPECT_LT((reverse.wi - kViews[1]).norm(), 1e-6f);
    EXPECT_LE(mirror.weight.maxCoeff(), 1.0f);
}

TEST(Sampler, PairsAreStratified) {
    // 256 points: one in each cell of 16 x 16.
    std::vector<int> count(256, 0);
    for (std::uint32_t i = 0; i < 256; ++i) {
        const Vec2f p = sobol_pair(i, 12345);
        ++count[static_cast<std::size_t>(p.x() * 16) * 16 + static_cast<std::size_t>(p.y() * 16)];
    }
    for (const int c : count) EXPECT_EQ(c, 1);
}

// The irradiance that sampling a light gives, with the density it claims.
TEST(Lights, DiscIrradianceIsTheClosedForm) {
    // On the axis of a Lambertian disc: E = pi L r^2 / (r^2 + h^2) (Lambert).
    const double r = 0.3, h = 0.5, radiance = 2.0;
    const DiscLight disc{Vec3(0, 0, h), Vec3(0, 0, -1), r,
                         Rgb::Constant(static_cast<float>(radiance * kPi * r * r))};
    const LightSampler lights({disc}, Rgb::Zero());
    double sum = 0;
    constexpr std::uint32_t kDraws = 1 << 14;
    for (std::uint32_t i = 0; i < kDraws; ++i) {
        const auto s = lights.sample(0, Vec3f::Zero(), sobol_pair(i, 1));
        ASSERT_TRUE(s);
        sum += s->radiance_over_pdf[0] * s->direction.z() / kDraws;
        EXPECT_NEAR(s->pdf / lights.pdf(0, Vec3f::Zero(), s->direction, s->distance), 1, 1e-4);
        const auto hit = lights.hit(0, Vec3f::Zero(), s->direction, 10.0f);
        if (hit) {
            EXPECT_NEAR(hit->radiance[0], radiance, 1e-5);
        }
    }
    EXPECT_NEAR(sum, kPi * radiance * r * r / (r * r + h * h), 0.002);
}

// Directions to a disc against the density claimed, over cells of the disc.
TEST(Lights, DiscSamplesFollowTheirDensity) {
    const DiscLight disc{Vec3(0.2, 0.1, 0.5), Vec3(-0.3, 0.1, -0.9).normalized(), 0.3,
                         Rgb::Constant(1.0f)};
    const LightSampler lights({disc}, Rgb::Zero());
    constexpr int kCells = 12, kDraws = 50000, kSub = 16;
    const Frame frame(disc.normal.cast<float>());
    const Vec3f centre = disc.position_m.cast<float>();
    const auto radius = static_cast<float>(disc.radius_m);
    std::vector<double> observed(kCells * kCells, 0.0), expected(observed.size(), 0.0);
    Rng rng(12);
    for (int i = 0; i < kDraws; ++i) {
        const auto s = lights.sample(0, Vec3f::Zero(), Vec2f(rng.next_float(), rng.next_float()));
        ASSERT_TRUE(s);
        const Vec3f local = frame.to_local(s->direction * s->distance - centre) / radius;
        const auto cell = [&](float v) {
            return static_cast<std::size_t>(std::clamp((v + 1) / 2 * kCells, 0.0f, kCells - 1.0f));
        };
        observed[cell(local.y()) * kCells + cell(local.x())] += 1;
    }
    const double step = 2.0 * radius / (kCells * kSub);
    for (int y = 0; y < kCells * kSub; ++y) {
        for (int x = 0; x < kCells * kSub; ++x) {
            const Vec2 p((x + 0.5) * step - radius, (y + 0.5) * step - radius);
            if (p.norm() > radius) continue;
            const Vec3f place = centre + frame.tangent * static_cast<float>(p.x()) +
                                frame.bitangent * static_cast<float>(p.y());
            const float distance = place.norm();
            const Vec3f direction = place / distance;
            const double solid_angle =
                -direction.dot(disc.normal.cast<float>()) * step * step / (distance * distance);
            expected[static_cast<std::size_t>(y / kSub * kCells + x / kSub)] +=
                kDraws * lights.pdf(0, Vec3f::Zero(), direction, distance) * solid_angle;
        }
    }
    EXPECT_GT(chi_square_test(observed, expected).p_value, 0.001);
}

// Rays emitted towards a sphere carry what crosses it: 4 pi I times its share of the sky.
TEST(Lights, EmittedPowerIsThatOfTheCone) {
    const Sphere target{Vec3f(0, 0, 0), 0.05f}, scene{Vec3f(0, 0, 0), 2.0f};
    const LightSampler lights(
        {PointLight{Vec3(0, 0, 1), Rgb::Constant(2.0f)},
         DirectionalLight{Vec3(0, 0.6, -0.8), Rgb::Constant(3.0f)},
         DiscLight{Vec3(0, 0, 1), Vec3(0, 0, -1), 0.001, Rgb::Constant(2.0f)},
         SpotLight{Vec3(0, 0, 1), Vec3(0, 0, -1), Rgb::Constant(2.0f), 30.0},
         EnvironmentLight{std::make_shared<ImageRgb>(16, 8, Rgb::Constant(2.0f)), "", 1.5}},
        Rgb::Zero());
    const double solid_angle = cone_solid_angle(std::asin(0.05));
    const double area = kPi * 0.05 * 0.05;
    const double expected[] = {2 * solid_angle, 3 * area, 2 * solid_angle, 2 * solid_angle,
                               2 * 1.5 * 4 * kPi * area};
    for (std::size_t light = 0; light < std::size(expected); ++light) {
        double power = 0;
        constexpr std::uint32_t kDraws = 4096;
        for (std::uint32_t i = 0; i < kDraws; ++i) {
            power += lights.emit(light, target, sobol_pair(i, 1), sobol_pair(i, 2), scene).power[0];
        }
        EXPECT_NEAR(power / kDraws / expected[light], 1.0, 2e-3) << light;
    }
}

TEST(Lights, SpotRaysFillTheConeEvenly) {
    const Sphere target{Vec3f(0.1f, -0.2f, 0), 0.3f}, scene{Vec3f(0, 0, 0), 2.0f};
    const Vec3 place(0, 0.3, 1);
    const LightSampler lights(
        {SpotLight{place, Vec3(0.1, -0.5, -1).normalized(), Rgb::Constant(2.0f), 70.0}},
        Rgb::Zero());
    const Vec3f axis = target.centre - place.cast<float>();
    const Frame frame(axis.normalized());
    const double cos_max = std::sqrt(1 - 0.3 * 0.3 / axis.squaredNorm());
    constexpr std::size_t kRings = 8, kSectors = 12;
    constexpr std::uint32_t kDraws = 40000;
    std::vector<double> observed(kRings * kSectors, 0.0);
    const std::vector<double> expected(observed.size(), double(kDraws) / (kRings * kSectors));
    Rng rng(17);
    for (std::uint32_t i = 0; i < kDraws; ++i) {
        const Vec2f u(rng.next_float(), rng.next_float());
        const Vec3f d = frame.to_local(lights.emit(0, target, u, u, scene).direction);
        const double ring = (1 - d.z()) / (1 - cos_max), turn = std::atan2(d.y(), d.x()) / kPi;
        const auto r = std::min(kRings - 1, static_cast<std::size_t>(ring * kRings));
        const auto k = std::min(kSectors - 1, static_cast<std::size_t>((turn + 1) / 2 * kSectors));
        observed[r * kSectors + k] += 1;
    }
    EXPECT_GT(chi_square_test(observed, expected).p_value, 0.001);
}

TEST(Lights, EnvironmentRaysFollowTheMapAndFillTheDisc) {
    auto map = std::make_shared<ImageRgb>(8, 4);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x)
            (*map)(x, y) = Rgb::Constant(static_cast<float>((x * 5 + y * 3) % 7));
    const LightSampler lights({EnvironmentLight{map, "", 1.0}}, Rgb::Zero());
    const Sphere target{Vec3f(0.1f, -0.2f, 0.3f), 0.2f}, scene{Vec3f(0, 0, 0), 2.0f};
    // Texel of the direction, and ring and half of the place on the disc across it.
    constexpr std::size_t kRings = 4;
    constexpr std::uint32_t kDraws = 60000;
    std::vector<double> observed(32 * kRings * 2, 0.0), expected(observed.size(), 0.0);
    Rng rng(23);
    for (std::uint32_t i = 0; i < kDraws; ++i) {
        const Vec2f u(rng.next_float(), rng.next_float()), v(rng.next_float(), rng.next_float());
        const EmittedRay ray = lights.emit(0, target, u, v, scene);
        const Vec3f w = -ray.direction;
        const float phi = std::atan2(w.y(), w.x()) + kPif;
        const auto y = std::min<std::size_t>(3, std::size_t(std::acos(w.z()) / kPif * 4));
        const auto x = std::min<std::size_t>(7, std::size_t(phi / (2 * kPif) * 8));
        const Vec3f to_axis = target.centre - ray.origin;
        const Vec3f across = to_axis - to_axis.dot(ray.direction) * ray.direction;
        const float share = across.squaredNorm() / (target.radius * target.radius);
        const auto ring = std::min(kRings - 1, static_cast<std::size_t>(share * kRings));
        const std::size_t half = across.dot(Frame(ray.direction).tangent) > 0 ? 1 : 0;
        observed[((y * 8 + x) * kRings + ring) * 2 + half] += 1;
    }
    double sum = 0;
    for (std::size_t texel = 0; texel < 32; ++texel) {
        const auto y = static_cast<double>(texel / 8);
        const double solid_angle = std::cos(kPi * y / 4) - std::cos(kPi * (y + 1) / 4);
        const double power = luminance((*map)[texel]) * solid_angle;
        sum += power;
        for (std::size_t k = 0; k < 2 * kRings; ++k)
            expected[texel * 2 * kRings + k] = power / (2 * kRings);
    }
    for (double& e : expected) e *= kDraws / sum;
    EXPECT_GT(chi_square_test(observed, expected).p_value, 0.001);
}

TEST(Lights, EnvironmentSamplesFollowTheirDensity) {
    auto map = std::make_shared<ImageRgb>(16, 8);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 16; ++x) {
            (*map)(x, y) = Rgb::Constant(static_cast<float>((x * 7 + y * 3) % 11));  // some black
        }
    }
    (*map)(5, 2) = Rgb(300.0f, 200.0f, 100.0f);  // a sun
    const LightSampler lights({EnvironmentLight{map, "", 1.0}}, Rgb::Zero());
    std::vector<double> observed(128, 0.0), expected(128, 0.0);
    constexpr std::uint32_t kDraws = 50000;
    Rng rng(9);
    for (std::uint32_t i = 0; i < kDraws; ++i) {
        const auto s = lights.sample(0, Vec3f::Zero(), Vec2f(rng.next_float(), rng.next_float()));
        ASSERT_TRUE(s);
        const float theta = std::acos(s->direction.z());
        const float phi = std::atan2(s->direction.y(), s->direction.x()) + kPif;
        const auto y = std::min<std::size_t>(7, static_cast<std::size_t>(theta / kPif * 8));
        const auto x = std::min<std::size_t>(15, static_cast<std::size_t>(phi / (2 * kPif) * 16));
        observed[y * 16 + x] += 1;
    }
    for (std::size_t y = 0; y < 8; ++y) {
        const double top = std::cos(kPi * double(y) / 8), low = std::cos(kPi * double(y + 1) / 8);
        for (std::size_t x = 0; x < 16; ++x) {
            const double theta = std::acos(0.5 * (top + low));
            const double phi = 2 * kPi * (double(x) + 0.5) / 16 - kPi;
            const Vec3f d = Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                 std::cos(theta))
                                .cast<float>();
            expected[y * 16 + x] =
                kDraws * lights.pdf(0, Vec3f::Zero(), d, 1e30f) * 2 * kPi / 16 * (top - low);
        }
    }
    EXPECT_GT(chi_square_test(observed, expected).p_value, 0.001);
}

}  // namespace
}  // namespace vitrine
