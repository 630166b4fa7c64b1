#include "render/ball_bounce.h"

#include "base/parallel.h"

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;

constexpr int kPatchesPerBall = 24;
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
    : cluster_(cluster),
      patch_direction_(sphere_directions(kPatchesPerBall)),
      ray_(sphere_directions(kRays)),
      spread_(kPatchesPerBall, kPatchesPerBall) {
    for (std::size_t k = 0; k < cluster.balls.size() + cluster.unseen_balls.size(); ++k) {
        for (const Vec3f& n : patch_direction_) {
            normal_.push_back(n);
            position_.push_back(ball_at(k).centre_px + ball_at(k).radius_px * n);
            ball_.push_back(k < cluster.balls.size() ? static_cast<std::int16_t>(k) : -1);
        }
    }
    for (Index j = 0; j < kPatchesPerBall; ++j) {
        for (Index i = 0; i < kPatchesPerBall; ++i) {
            const float r = (patch_direction_[static_cast<std::size_t>(i)] -
                             patch_direction_[static_cast<std::size_t>(j)])
                                .norm();
            spread_(i, j) = std::exp(-r / kSpread);
        }
        spread_.col(j) /= spread_.col(j).sum();
    }
    between_ = view_from(patches()).patches;
}

const Ball& BallBounce::ball_at(std::size_t k) const {
    const std::size_t seen = cluster_.balls.size();
    return k < seen ? cluster_.balls[k] : cluster_.unseen_balls[k - seen];
}

std::size_t BallBounce::first_hit(const Vec3f& point, const Vec3f& direction, std::int16_t own,
                                  float& distance) const {
    const std::size_t count = cluster_.balls.size() + cluster_.unseen_balls.size();
    std::size_t hit = count;
    distance = 1e30f;
    for (std::size_t k = 0; k < count; ++k) {
        if (static_cast<std::int16_t>(k) == own) continue;
        const Ball& ball = ball_at(k);
        const Vec3f to_centre = ball.centre_px - point;
        const float along = to_centre.dot(direction);
        // A ball behind the point is not met, so an unseen ball does not hide its own patches.
        if (along <= 0) continue;
        const float rest =
            ball.radius_px * ball.radius_px - to_centre.squaredNorm() + along * along;
        if (rest <= 0) continue;
        const float ahead = std::max(0.0f, along - std::sqrt(rest));
        if (ahead >= distance) continue;
        distance = ahead;
        hit = k;
    }
    return hit;
}

std::size_t BallBounce::patch_at(std::size_t ball, const Vec3f& point) const {
    const Vec3f out = point - ball_at(ball).centre_px;
    std::size_t patch = 0;
    for (std::size_t j = 1; j < patch_direction_.size(); ++j)
        if (patch_direction_[j].dot(out) > patch_direction_[patch].dot(out)) patch = j;
    return ball * patch_direction_.size() + patch;
}

template <typename OnPatch, typename OnSky>
void BallBounce::look_around(const SurfacePoints& points, std::size_t i, const OnPatch& on_patch,
                             const OnSky& on_sky) const {
    const Vec3f p = points.position[i], n = points.normal[i];
    const std::size_t none = cluster_.balls.size() + cluster_.unseen_balls.size();
    for (const Vec3f& ray : ray_) {
        const float cosine = n.dot(ray);
        if (cosine <= 0) continue;
        float distance = 0;
        const std::size_t hit = first_hit(p, ray, points.ball[i], distance);
        if (hit == none) {
            on_sky(ray, cosine);
        } else {
            on_patch(patch_at(hit, p + distance * ray), cosine);
        }
    }
}

BallBounce::View BallBounce::view_from(const SurfacePoints& points) const {
    const std::size_t count = points.position.size();
    View view{MatrixXf::Zero(static_cast<Index>(count), static_cast<Index>(position_.size())),
              {std::vector<float>(count, 0.0f), std::vector<float>(count, 0.0f)}};
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
                view.patches(static_cast<Index>(i), static_cast<Index>(patch)) += cosine / all;
            },
            [&](const Vec3f& ray, float cosine) {
                view.sky.ambient[i] += cosine / all;
                if (ray.y() < 0) {
                    view.sky.below[i] += cosine / all_below * facing_down(points.normal[i]);
                }
            });
    });
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

std::vector<Rgb> BallBounce::irradiance(const SurfacePoints& points,
                                        const MatrixXf& exitance) const {
    std::vector<Rgb> result(points.position.size(), Rgb::Zero());
    parallel_for(points.position.size(), 64, [&](std::size_t i) {
        float all = 0;
        for (const Vec3f& ray : ray_) all += std::max(0.0f, points.normal[i].dot(ray));
        look_around(
            points, i,
            [&](std::size_t patch, float cosine) {
                result[i] +=
                    cosine / all * exitance.row(static_cast<Index>(patch)).transpose().array();
            },
            [](const Vec3f&, float) {});
    });
    return result;
}

std::vector<Rgb> with_bounces(const Relief& relief, const SurfacePoints& points,
                              const std::function<std::vector<Rgb>(const SurfacePoints&)>& direct) {
    std::vector<Rgb> result = direct(points);
    if (!relief.is_cluster() || relief.ball_albedo.maxCoeff() <= 0) return result;
    const BallBounce bounce(relief);
    const std::vector<Rgb> on_patches = direct(bounce.patches());
    MatrixXf exitance(static_cast<Index>(on_patches.size()), 3);
    for (Index i = 0; i < exitance.rows(); ++i)
        exitance.row(i) = on_patches[static_cast<std::size_t>(i)].matrix().transpose();
    for (int c = 0; c < 3; ++c)
        exitance.col(c) = bounce.exitance(exitance.col(c), relief.ball_albedo[c]).col(0);
    const std::vector<Rgb> added = bounce.irradiance(points, exitance);
    for (std::size_t i = 0; i < result.size(); ++i) result[i] += added[i];
    return result;
}

}  // namespace vitrine
