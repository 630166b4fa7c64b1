#include "optics/curved_body.h"

#include "base/rng.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

/// Where light that entered at the top of a ball of radius `radius` mean free paths leaves again:
/// weight by distance from the entry, in `bin_count` bins up to 2 R, and the sum beyond.
struct Escape {
    std::vector<double> weight;
    double total = 0;
};
Escape random_walks(double radius, double single_albedo, double bin_width, int walk_count) {
    Escape escape;
    escape.weight.assign(64, 0.0);
    Rng rng(stream_key(3, static_cast<std::uint64_t>(radius * 10)));
    for (int i = 0; i < walk_count; ++i) {
        Vec3 p(0, 0, radius);
        const double u = rng.next_double(), turn = 2 * kPi * rng.next_double();
        Vec3 w(std::sqrt(1 - u) * std::cos(turn), std::sqrt(1 - u) * std::sin(turn), -std::sqrt(u));
        double weight = 1;
        for (int step = 0; step < 400; ++step) {
            const double free = -std::log(1 - rng.next_double());
            const double b = p.dot(w), c = p.squaredNorm() - radius * radius;
            const double out = -b + std::sqrt(std::max(0.0, b * b - c));
            if (free >= out) {
                const double r = (p + out * w - Vec3(0, 0, radius)).norm();
                const auto bin = static_cast<std::size_t>(r / bin_width);
                if (bin < escape.weight.size()) escape.weight[bin] += weight / walk_count;
                escape.total += weight / walk_count;
                break;
            }
            p += free * w;
            weight *= single_albedo;
            const double z = 2 * rng.next_double() - 1, phi = 2 * kPi * rng.next_double();
            const double rho = std::sqrt(1 - z * z);
            w = Vec3(rho * std::cos(phi), rho * std::sin(phi), z);
        }
    }
    return escape;
}

TEST(CurvedBody, PredictsWhatRandomWalksLoseInBalls) {
    constexpr double kBin = 0.25;  // mean free paths
    constexpr int kWalks = 12000;
    for (const double single_albedo : {0.6, 0.92}) {
        const Escape flat = random_walks(2000, single_albedo, kBin, kWalks);
        const CurvedBodyFactor factor = curved_body_factor(flat.total);
        for (const double radius : {2.0, 4.0}) {
            // On a ball the surface within a chord r is pi r^2, as on the plane.
            double predicted = 0;
            for (std::size_t k = 0; k < flat.weight.size(); ++k) {
                const double r = (static_cast<double>(k) + 0.5) * kBin;
                if (r < 2 * radius) predicted += flat.weight[k] * factor(r / (2 * radius));
            }
            const double walked = random_walks(radius, single_albedo, kBin, kWalks).total;
            EXPECT_GT(walked, 1.1 * flat.total) << radius;
            EXPECT_NEAR(predicted / walked, 1, 0.1) << single_albedo << " " << radius;
        }
    }
}

TEST(CurvedBody, FlatSurfacesAndHollowsAreNotChanged) {
    const CurvedBodyFactor factor = curved_body_factor(0.5);
    EXPECT_DOUBLE_EQ(factor(0), 1);
    EXPECT_EQ(chord_rise({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 0, 1}), 0);
    EXPECT_EQ(chord_rise({0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {-1, 0, 0}), 0);  // facing each other
    EXPECT_FLOAT_EQ(chord_rise({0, 0, 1}, {0, 0, 1}, {0, 0, -1}, {0, 0, -1}), 1);
    EXPECT_GT(curved_body_factor(0.1)(0.5), curved_body_factor(0.8)(0.5));
}

}  // namespace
}  // namespace vitrine
