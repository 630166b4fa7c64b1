#include "render/cluster_tree.h"

#include "geometry/even_samples.h"
#include "geometry/primitives.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

TEST(ClusterTree, AgreesWithThePlainSum) {
    const EvenSamples samples = sample_evenly(make_torus(0.05, 0.02, Vec3::Zero()), 0.002, 1);
    std::vector<Rgb> weight;  // lit from one side
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const float side = std::max(0.0f, samples.normals[i].dot(Vec3f(0.6f, 0.0f, 0.8f)));
        weight.push_back(Rgb(1.0f, 0.8f, 0.6f) * (0.05f + side) * samples.area_m2[i]);
    }
    const ClusterTree tree(samples.points);
    const ClusterTree::Weights weights(tree, weight);
    for (const double length : {0.004, 0.01, 0.03}) {
        const TwoExponentials fit{1.0, -1 / length, 0.1, -0.3 / length};
        const RadialProfile profile = tabulate({fit, fit.scaled(1.5), fit.scaled(0.7)}, 1e-4, 0.3);
        const KernelTable kernel(profile, ClusterTree::kSmallestShare * tree.largest_square(),
                                 tree.largest_square());
        double error = 0;
        int count = 0;
        for (std::size_t i = 0; i < samples.size(); i += 397) {
            Rgbd plain = Rgbd::Zero();
            for (std::size_t k = 0; k < samples.size(); ++k) {
                const double q = (samples.points[k] - samples.points[i]).squaredNorm();
                plain += profile.at(std::sqrt(q)) * weight[k].cast<double>();
            }
            const Rgb fast = weights.sum(samples.points[i], kernel);
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(fast[c] / plain[c], 1.0, 0.02) << length;
                error += std::abs(fast[c] / plain[c] - 1);
                ++count;
            }
        }
        EXPECT_LT(error / count, 0.005) << length;
    }
}

TEST(ClusterTree, NothingGivesNothing) {
    const ClusterTree tree(std::vector<Vec3f>{});
    const KernelTable kernel(tabulate({}, 1e-4, 0.3), 1e-9f, 1.0f);
    EXPECT_TRUE((ClusterTree::Weights(tree, {}).sum(Vec3f::Zero(), kernel) == 0).all());
}

}  // namespace
}  // namespace vitrine
