#include "reconstruct/pose_refinement.h"

#include "base/log.h"
#include "base/parallel.h"
#include "capture/exposure_gains.h"
#include "image/filter.h"
#include "reconstruct/scan.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <numeric>

namespace vitrine {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr double kLuminanceNoise =
    0.02;                       // square-root encoded: sensor, resampling, not quite diffuse
constexpr double kTukey = 4.0;  // residuals beyond this many deviations are outliers
constexpr double kMaxDepthStep_m = 0.02;  // between neighbours: beyond, a depth edge
constexpr int kNormalReach_px = 3;
constexpr std::size_t kMinComparisons = 200;  // of a pair of views, else it says nothing

/// One frame prepared for a level: points with normals, blurred luminance.
struct Level {
    ImageF luminance;  ///< square-root encoded, blurred
    std::vector<Vec2> pixels;
    std::vector<Vec3> points;   ///< in the camera
    std::vector<Vec3> normals;  ///< in the camera
};

/// Normal from the depth around a pixel; false at edges and holes.
bool depth_normal(const RgbdFrame& frame, int x, int y, Vec3& normal) {
    const auto point = [&](int u, int v) {
        return Vec3(double(frame.depth_m(u, v)) * frame.camera.ray_in_camera(u, v));
    };
    const double z = frame.depth_m(x, y);
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        const double there = frame.depth_m(x + dx * kNormalReach_px, y + dy * kNormalReach_px);
        if (there <= 0 || std::abs(there - z) > kMaxDepthStep_m) return false;
    }
    const Vec3 across = point(x + kNormalReach_px, y) - point(x - kNormalReach_px, y);
    const Vec3 down = point(x, y + kNormalReach_px) - point(x, y - kNormalReach_px);
    normal = across.cross(down).normalized();
    if (normal.dot(frame.camera.ray_in_camera(x, y)) > 0) normal = -normal;
    return normal.allFinite();
}

Level prepare(const RgbdFrame& frame, const Mask* excluded, double saturation_level, double gain,
              double blur_px, int samples) {
    Level level;
    const int width = frame.colour.width(), height = frame.colour.height();
    ImageF raw(width, height);
    for (std::size_t i = 0; i < raw.size(); ++i) {
        raw[i] = std::sqrt(std::max(0.0f, luminance(frame.colour[i]) / static_cast<float>(gain)));
    }
    level.luminance = gaussian_blur(raw, blur_px);
    const int step = std::max(1, static_cast<int>(std::sqrt(double(width) * height / samples)));
    for (int y = kNormalReach_px + 1; y + kNormalReach_px + 1 < height; y += step) {
        for (int x = kNormalReach_px + 1; x + kNormalReach_px + 1 < width; x += step) {
            const double z = frame.depth_m(x, y);
            if (z <= 0 || (excluded && is_inside(*excluded, x, y))) continue;
            if (is_saturated(frame.colour(x, y), saturation_level)) continue;
            Vec3 normal;
            if (!depth_normal(frame, x, y, normal)) continue;
            level.pixels.emplace_back(x, y);
            level.points.push_back(z * frame.camera.ray_in_camera(x, y));
            level.normals.push_back(normal);
        }
    }
    return level;
}

/// Sums of one pair. Both poses enter with opposite signs, so one block is enough.
struct PairSums {
    Mat6 hessian = Mat6::Zero();
    Vec6 gradient = Vec6::Zero();
    double cost = 0.0;
    std::size_t count = 0;
};

/// Adds a residual whose value changes by a . (motion of `point`), in units of its noise.
void add_residual(double residual, const Vec3& a, const Vec3& point, PairSums& sums) {
    const double r = residual / kTukey;
    if (std::abs(r) >= 1) {
        sums.cost += kTukey * kTukey / 6;
        return;
    }
    const double keep = 1 - r * r;
    sums.cost += kTukey * kTukey / 6 * (1 - keep * keep * keep);
    Vec6 jacobian;
    jacobian << point.cross(a), a;
    sums.hessian += keep * keep * jacobian * jacobian.transpose();
    sums.gradient += keep * keep * residual * jacobian;
}

PairSums compare(const RgbdFrame& to_frame, const Camera& from, const Camera& to,
                 const Level& from_level, const Level& to_level, const Mask* to_excluded,
                 double noise_scale) {
    PairSums sums;
    const Rigid3 world_from_from = from.cam_from_world.inverse();
    const Rigid3 world_from_to = to.cam_from_world.inverse();
    for (std::size_t i = 0; i < from_level.points.size(); ++i) {
        const Vec3 p = world_from_from * from_level.points[i];
        const Vec3 q = to.cam_from_world * p;
        if (q.z() <= 0.05) continue;
        const Vec2 pixel = to.project_camera(q);
        if (!to.sees(pixel, 2)) continue;
        const int x = static_cast<int>(std::lround(pixel.x()));
        const int y = static_cast<int>(std::lround(pixel.y()));
        const double z = to_frame.depth_m(x, y);
        if (z <= 0 || std::abs(z - q.z()) > 0.01 + 0.03 * noise_scale) continue;
        if (to_excluded && is_inside(*to_excluded, x, y)) continue;
        // Geometry: the surface of `to` along its ray, against the plane through p.
        const Vec3 normal = world_from_from.rotation * from_level.normals[i];
        const Vec3 on_to = world_from_to * (z * to.ray_in_camera(x, y));
        const double sigma = noise_scale * std::hypot(depth_noise_m(z), depth_noise_m(q.z()));
        add_residual(normal.dot(p - on_to) / sigma, normal / sigma, p, sums);
        // Colour: the picture of `to` where p falls.
        const double u = pixel.x(), v = pixel.y();
        const double gx =
            0.5 * (bilinear(to_level.luminance, u + 1, v) - bilinear(to_level.luminance, u - 1, v));
        const double gy =
            0.5 * (bilinear(to_level.luminance, u, v + 1) - bilinear(to_level.luminance, u, v - 1));
        const Vec3 along(gx * to.fx / q.z(), gy * to.fy / q.z(),
                         -(gx * to.fx * q.x() + gy * to.fy * q.y()) / (q.z() * q.z()));
        const Vec3 a = world_from_to.rotation * along;
        const double here =
            bilinear(from_level.luminance, from_level.pixels[i].x(), from_level.pixels[i].y());
        const double difference = bilinear(to_level.luminance, u, v) - here;
        const double noise = noise_scale * kLuminanceNoise;
        add_residual(difference / noise, a / noise, p, sums);
        ++sums.count;
    }
    return sums;
}

/// Ordered pairs of views that look at much the same: nearest in direction and place.
std::vector<std::pair<std::size_t, std::size_t>> choose_pairs(const std::vector<Camera>& cameras,
                                                              int max_partners) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        std::vector<std::pair<double, std::size_t>> others;
        for (std::size_t j = 0; j < cameras.size(); ++j) {
            if (i == j) continue;
            const double turn =
                angle_between(cameras[i].ray_in_world(cameras[i].cx, cameras[i].cy),
                              cameras[j].ray_in_world(cameras[j].cx, cameras[j].cy));
            const double way = (cameras[i].centre_in_world() - cameras[j].centre_in_world()).norm();
            others.emplace_back(turn + way, j);
        }
        std::sort(others.begin(), others.end());
        for (std::size_t k = 0; k < std::min<std::size_t>(others.size(), std::size_t(max_partners));
             ++k) {
            pairs.emplace_back(i, others[k].second);
        }
    }
    return pairs;
}

struct Problem {
    const Capture* capture;
    std::span<const Mask> excluded;
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    std::vector<Level> levels;
    std::vector<double> gain;  ///< of each frame's exposure
    double noise_scale = 1.0;

    const Mask* excluded_of(std::size_t i) const {
        return excluded.empty() || excluded[i].empty() ? nullptr : &excluded[i];
    }
};

/// All pairs; those that overlap too little are cleared. Summed in order of the pairs.
std::vector<PairSums> compare_all(const Problem& problem, const std::vector<Camera>& cameras) {
    std::vector<PairSums> sums(problem.pairs.size());
    parallel_for(sums.size(), 1, [&](std::size_t k) {
        const auto [i, j] = problem.pairs[k];
        sums[k] = compare(problem.capture->frames[j], cameras[i], cameras[j], problem.levels[i],
                          problem.levels[j], problem.excluded_of(j), problem.noise_scale);
        if (sums[k].count < kMinComparisons) sums[k] = {};
    });
    return sums;
}

/// Mean cost per comparison.
double mean_cost(const std::vector<PairSums>& sums, std::size_t& count) {
    double cost = 0;
    count = 0;
    for (const PairSums& s : sums) cost += s.cost, count += s.count;
    return count > 0 ? cost / double(count) : 0.0;
}

std::vector<Camera> stepped(const Problem& problem, const std::vector<PairSums>& sums,
                            const std::vector<Camera>& cameras, double damping) {
    const auto size = static_cast<Eigen::Index>(6 * (cameras.size() - 1));
    Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    for (std::size_t k = 0; k < sums.size(); ++k) {
        const auto [i, j] = problem.pairs[k];
        // Frame 0 has no unknowns: it holds the world.
        const auto at = [](std::size_t frame) {
            return 6 * (static_cast<Eigen::Index>(frame) - 1);
        };
        if (i > 0) {
            hessian.block<6, 6>(at(i), at(i)) += sums[k].hessian;
            gradient.segment<6>(at(i)) += sums[k].gradient;
        }
        if (j > 0) {
            hessian.block<6, 6>(at(j), at(j)) += sums[k].hessian;
            gradient.segment<6>(at(j)) -= sums[k].gradient;
        }
        if (i > 0 && j > 0) {
            hessian.block<6, 6>(at(i), at(j)) -= sums[k].hessian;
            hessian.block<6, 6>(at(j), at(i)) -= sums[k].hessian;
        }
    }
    hessian.diagonal().array() = hessian.diagonal().array() * (1 + damping) + 1e-3;
    const Eigen::VectorXd step = hessian.ldlt().solve(-gradient);
    std::vector<Camera> moved = cameras;
    for (std::size_t i = 1; i < cameras.size(); ++i) {
        const Vec6 xi = step.segment<6>(6 * (static_cast<Eigen::Index>(i) - 1));
        const Rigid3 motion = rigid_from_twist(xi.head<3>(), xi.tail<3>());
        moved[i].cam_from_world = cameras[i].cam_from_world * motion.inverse();
    }
    return moved;
}

void descend(const Problem& problem, int steps, std::vector<Camera>& cameras) {
    std::size_t count = 0;
    std::vector<PairSums> sums = compare_all(problem, cameras);
    double cost = mean_cost(sums, count);
    double damping = 1e-3;
    for (int step = 0; step < steps && damping < 1e4; ++step) {
        const std::vector<Camera> trial = stepped(problem, sums, cameras, damping);
        std::vector<PairSums> trial_sums = compare_all(problem, trial);
        std::size_t trial_count = 0;
        const double trial_cost = mean_cost(trial_sums, trial_count);
        // Losing sight of each other must not look like agreement.
        if (trial_cost < cost && 10 * trial_count > 9 * count) {
            const bool is_done = cost - trial_cost < 1e-5 * cost;
            cameras = trial;
            sums = std::move(trial_sums);
            cost = trial_cost;
            count = trial_count;
            damping = std::max(1e-6, damping / 5);
            if (is_done) break;
        } else {
            damping *= 10;
        }
    }
}

}  // namespace

PoseRefinement refine_poses(const Capture& capture, const std::vector<Camera>& start,
                            std::span<const Mask> excluded, const PoseRefinementOptions& options,
                            const Progress& progress) {
    VITRINE_CHECK_EQ(capture.frames.size(), start.size());
    PoseRefinement result;
    result.cameras = start;
    if (start.size() < 2) return result;
    Problem problem{&capture,
                    excluded,
                    choose_pairs(start, options.max_partners),
                    {},
                    estimate_exposure_gains(capture, start, excluded).gain,
                    1.0};
    std::vector<Camera> cameras = start;
    for (std::size_t level = 0; level < options.blur_px.size(); ++level) {
        progress.update(double(level) / double(options.blur_px.size()), "refining poses");
        const bool is_finest = level + 1 == options.blur_px.size();
        problem.noise_scale = is_finest ? 1.0 : 1.0 + options.blur_px[level];
        problem.levels.assign(start.size(), {});
        parallel_for(start.size(), 1, [&](std::size_t i) {
            problem.levels[i] =
                prepare(capture.frames[i], problem.excluded_of(i), capture.saturation_level,
                        problem.gain[i], options.blur_px[level], options.samples_per_frame);
        });
        descend(problem, options.steps_per_level, cameras);
    }
    result.cost_before = mean_cost(compare_all(problem, start), result.comparisons);
    std::size_t count = 0;
    result.cost_after = mean_cost(compare_all(problem, cameras), count);
    result.is_accepted = count > 0 && 10 * count > 9 * result.comparisons &&
                         result.cost_after < (1 - options.min_gain) * result.cost_before;
    if (result.is_accepted) result.cameras = cameras;
    log_debug("poses: cost {:.4f} -> {:.4f}, {} comparisons", result.cost_before, result.cost_after,
              count);
    return result;
}

}  // namespace vitrine
