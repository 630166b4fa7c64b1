#include "render/ball_bounce.h"

#include "base/parallel.h"

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

constexpr int kRays = 40;
constexpr int kBounces = 12;
/// Reach of the kernel that spreads light in a ball, in radii.
constexpr float kSpread = 0.5f;

std::vector<Vec3f> sphere_directions(int count) {
    std::vector<Vec3f> result;
    for (const Vec3& direction : fibonacci_directions(count, -1.0))
        result.push_back(direction.cast<float>());
    return result;
}

}  // namespace

BallBounce::BallBounce(const Relief& cluster)
    : cluster_(cluster), ray_(sphere_directions(kRays)), spread_(kPatchesPerBall, kPatchesPerBall) {
    const std::vector<Vec3f> directions = sphere_directions(kPatchesPerBall);
    for (Index j = 0; j < kPatchesPerBall; ++j)
        patch_direction_.row(j) = directions[static_cast<std::size_t>(j)].transpose();
    for (std::size_t k = 0; k < cluster.balls.size() + cluster.unseen_balls.size(); ++k) {
        for (const Vec3f& n : directions) {
            normal_.push_back(n);
            position_.push_back(ball_at(k).centre_px + ball_at(k).radius_px * n);
            ball_.push_back(k < cluster.balls.size() ? static_cast<std::int16_t>(k) : -1);
        }
    }
    for (Index j = 0; j < kPatchesPerBall; ++j) {
        for (Index i = 0; i < kPatchesPerBall; ++i) {
            const float r = (patch_direction_.row(i) - patch_direction_.row(j)).norm();
            spread_(i, j) = std::exp(-r / kSpread);
        }
        spread_.col(j) /= spread_.col(j).sum();
    }
    View view = view_from(patches());
    between_ = std::move(view.patches);
    sky_ = std::move(view.sky);
}

const Ball& BallBounce::ball_at(std::size_t k) const {
    const std::size_t seen = cluster_.balls.size();
    return k < seen ? cluster_.balls[k] : cluster_.unseen_balls[k - seen];
}

std::size_t BallBounce::patch_at(std::size_t ball, const Vec3f& point) const {
    const Eigen::Matrix<float, kPatchesPerBall, 1> along =
        patch_direction_ * (point - ball_at(ball).centre_px);
    Index patch = 0;
    along.maxCoeff(&patch);
    return ball * kPatchesPerBall + static_cast<std::size_t>(patch);
}

template <typename OnPatch, typename OnSky>
void BallBounce::look_around(const SurfacePoints& points, std::size_t i, const OnPatch& on_patch,
                             const OnSky& on_sky) const {
    const Vec3f p = points.position[i], n = points.normal[i];
    std::vector<BallAhead> ahead;  // those that rise over the tangent plane
    const std::size_t count = cluster_.balls.size() + cluster_.unseen_balls.size();
    for (std::size_t k = 0; k < count; ++k) {
        if (static_cast<std::int16_t>(k) == points.ball[i]) continue;
        const BallAhead ball(k, ball_at(k), p);
        if (ball.to_centre.dot(n) + ball_at(k).radius_px > 0) ahead.push_back(ball);
    }
    for (const Vec3f& ray : ray_) {
        const float cosine = n.dot(ray);
        if (cosine <= 0) continue;
        const BallAhead* hit = nullptr;
        float distance = 1e30f;
        for (const BallAhead& ball : ahead) {
            const float along = ball.to_centre.dot(ray);
            if (!ball.is_met(along)) continue;
            const float reach = ball.distance(along);
            if (reach >= distance) continue;
            distance = reach;
            hit = &ball;
        }
        if (hit == nullptr) {
            on_sky(ray, cosine);
        } else {
            on_patch(patch_at(hit->ball, p + distance * ray), cosine);
        }
    }
}

BallBounce::View BallBounce::view_from(const SurfacePoints& points) const {
    const std::size_t count = points.position.size();
    View view{{static_cast<Index>(count), static_cast<Index>(position_.size())},
              {std::vector<float>(count, 0.0f), std::vector<float>(count, 0.0f)}};
    std::vector<std::vector<Eigen::Triplet<float>>> rows(count);
    parallel_for(count, 64, [&](std::size_t i) {
        float all = 0, all_below = 0;
        for (const Vec3f& ray : ray_) {
            const float cosine = std::max(0.0f, points.normal[i].dot(ray));
            all += cosine;
            if (ray.y() < 0) all_below += cosine;
        }
        look_around(
            points, i,
            [&](std::size_t patch, float cosine) {
                rows[i].emplace_back(static_cast<int>(i), static_cast<int>(patch), cosine / all);
            },
            [&](const Vec3f& ray, float cosine) {
                view.sky.ambient[i] += cosine / all;
                if (ray.y() < 0) {
                    view.sky.below[i] += cosine / all_below * facing_down(points.normal[i]);
                }
            });
    });
    std::vector<Eigen::Triplet<float>> all_rows;
    for (const auto& row : rows) all_rows.insert(all_rows.end(), row.begin(), row.end());
    view.patches.setFromTriplets(all_rows.begin(), all_rows.end());
    return view;
}

MatrixXf BallBounce::exitance(const MatrixXf& direct, double albedo) const {
    MatrixXf result = MatrixXf::Zero(direct.rows(), direct.cols());
    for (int bounce = 0; bounce < kBounces; ++bounce) {
        const MatrixXf light = direct + between_ * result;
        for (Index k = 0; k < light.rows(); k += kPatchesPerBall) {
            result.middleRows(k, kPatchesPerBall) =
                static_cast<float>(albedo) * (spread_ * light.middleRows(k, kPatchesPerBall));
        }
    }
    return result;
}

SoftBallLight::SoftBallLight(const Relief& cluster, const ViewLights& lights, double eta)
    : bounce_(cluster), lights_(lights) {
    const SurfacePoints patches = bounce_.patches();
    const std::vector<Rgb> lamps = lamp_light(Occluder(cluster), patches, lights, eta, true);
    MatrixXf direct(static_cast<Index>(lamps.size()), 3);
    for (std::size_t i = 0; i < lamps.size(); ++i) {
        direct.row(static_cast<Index>(i)) =
            (lamps[i] + sky_light(lights, bounce_.patch_sky(), i)).matrix().transpose();
    }
    exitance_.resize(direct.rows(), 3);
    for (int c = 0; c < 3; ++c)
        exitance_.col(c) = bounce_.exitance(direct.col(c), cluster.ball_albedo[c]);
}

std::vector<Rgb> SoftBallLight::at(const SurfacePoints& points) const {
    const BallBounce::View view = bounce_.view_from(points);
    const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> bounced =
        view.patches * exitance_;
    std::vector<Rgb> result;
    for (std::size_t i = 0; i < points.position.size(); ++i) {
        result.push_back(sky_light(lights_, view.sky, i) +
                         bounced.row(static_cast<Index>(i)).transpose().array());
    }
    return result;
}

}  // namespace vitrine
