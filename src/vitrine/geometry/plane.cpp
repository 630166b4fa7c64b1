#include "geometry/plane.h"

#include "base/rng.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {

constexpr std::size_t kMaxScored = 5000;  // enough to rank planes to 1 %

/// Weighted least squares: the eigenvector of the smallest eigenvalue of the scatter matrix.
Plane weighted_plane(std::span<const Vec3> points, const std::vector<double>& weights) {
    double sum = 0;
    Vec3 centre = Vec3::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
        sum += weights[i];
        centre += weights[i] * points[i];
    }
    centre /= sum;
    Mat3 scatter = Mat3::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3 d = points[i] - centre;
        scatter += weights[i] * d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(scatter);
    const Vec3 normal = solver.eigenvectors().col(0).normalized();
    return {normal, normal.dot(centre)};
}

}  // namespace

Rigid3 plane_from_world(const Plane& plane) {
    const Mat3 rotation =
        Eigen::Quaterniond::FromTwoVectors(plane.normal, Vec3::UnitZ()).toRotationMatrix();
    return {rotation, Vec3(0, 0, -plane.offset_m)};
}

PlaneFit fit_plane(std::span<const Vec3> points, double tolerance_m, int trials,
                   std::uint64_t seed) {
    PlaneFit best;
    if (points.size() < 3) return best;
    const std::size_t step = std::max<std::size_t>(1, points.size() / kMaxScored);
    std::size_t best_score = 0;
    for (int trial = 0; trial < trials; ++trial) {
        Rng rng(stream_key(seed, 0x91a7e, trial));
        const auto pick = [&] {
            return points[rng.next_index(static_cast<std::uint32_t>(points.size()))];
        };
        const Vec3 a = pick(), b = pick(), c = pick();
        const Vec3 cross = (b - a).cross(c - a);
        if (cross.norm() < 1e-9) continue;
        const Plane plane{cross.normalized(), cross.normalized().dot(a)};
        std::size_t score = 0;
        for (std::size_t i = 0; i < points.size(); i += step) {
            score += std::abs(plane.height(points[i])) < tolerance_m ? 1 : 0;
        }
        if (score > best_score) {
            best_score = score;
            best.plane = plane;
        }
    }
    if (best_score == 0) return best;
    std::vector<double> weights(points.size());
    for (int round = 0; round < 8; ++round) {
        const double scale = round < 3 ? 2 * tolerance_m : tolerance_m;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const double r = best.plane.height(points[i]) / scale;
            weights[i] = std::abs(r) < 1 ? (1 - r * r) * (1 - r * r) : 0.0;
        }
        best.plane = weighted_plane(points, weights);
    }
    double squares = 0;
    for (const Vec3& p : points) {
        const double h = best.plane.height(p);
        if (std::abs(h) >= tolerance_m) continue;
        ++best.inliers;
        squares += h * h;
    }
    best.rms_m = best.inliers > 0 ? std::sqrt(squares / double(best.inliers)) : 0.0;
    return best;
}

}  // namespace vitrine
