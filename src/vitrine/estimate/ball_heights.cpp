#include "estimate/ball_heights.h"

#include "base/error.h"
#include "base/rng.h"
#include "estimate/light_fields.h"
#include "estimate/profile_fit.h"
#include "image/filter.h"
#include "math/nnls.h"

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Pair {
    std::size_t front, back;
    double rise;  ///< between centres when they touch
};

/// Who is before whom where two discs overlap.
std::vector<Pair> pairs_of(const Relief& cluster) {
    const std::vector<Ball>& balls = cluster.balls;
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < balls.size(); ++i) {
        for (std::size_t j = i + 1; j < balls.size(); ++j) {
            const double reach = balls[i].radius_px + balls[j].radius_px;
            const double apart = (balls[i].centre_px - balls[j].centre_px).head<2>().norm();
            if (apart >= reach) continue;
            const bool is_first = balls[i].centre_px.z() > balls[j].centre_px.z();
            pairs.push_back(
                {is_first ? i : j, is_first ? j : i, std::sqrt(reach * reach - apart * apart)});
        }
    }
    return pairs;
}

class Heights {
  public:
    Heights(const Relief& cluster, const ImageRgb& diffuse, const Mask& excluded,
            const ViewLightsEstimate& lights, const BallHeightOptions& options)
        : options_(options),
          lights_(lights),
          work_(cluster),
          pairs_(pairs_of(cluster)),
          samples_(sample_relief(cluster, options.samples_per_side)),
          observations_(draw_observations(cluster, excluded,
                                          static_cast<std::size_t>(options.observation_count), 2.0,
                                          0.2, stream_key(options.seed, 0x33))) {
        if (!has_pixels()) return;
        y_ = exitance_rows(gaussian_blur(diffuse, 1.0), observations_, options.eta);
        for (const ViewLight& light : lights.lights.lights) directions_.push_back(light.direction);
        const LitRelief object(work_, samples_, observations_, options.eta, true);
        const LightPaths paths(object);  // within each ball: they move along
        for (int c = 0; c < 3; ++c) {
            const double mean = y_.col(c).mean();
            const bool is_dark =
                lights.kernel[static_cast<std::size_t>(c)].total() <= 0 || mean <= 0;
            if (is_dark) continue;
            channels_.push_back(c);
            y_.col(c) /= mean;
            operators_.emplace_back(paths, lights.kernel[static_cast<std::size_t>(c)],
                                    curved_body_factor(kTypicalAlbedo));
        }
        if (channels_.empty()) return;
        weight_ = y_.cwiseMax(0.2).cwiseInverse();
        reweight(object);
    }

    bool can_tell() const { return has_pixels() && !channels_.empty(); }

    double cost(const std::vector<Ball>& balls) {
        ReliefSamples samples = samples_;
        ReliefObservations observations = observations_;
        for (std::size_t i = 0; i < samples.ball.size(); ++i)
            samples.position[i].z() += rise(balls, samples.ball[i]);
        for (std::size_t i = 0; i < observations.ball.size(); ++i)
            observations.position[i].z() += rise(balls, observations.ball[i]);
        std::vector<Ball> before = work_.balls;
        work_.balls = balls;
        const LitRelief object(work_, std::move(samples), std::move(observations), options_.eta,
                               true);
        const double misfit = solve(images_of(object)).misfit;
        work_.balls = std::move(before);
        double sum = 0.5 * options_.looks * std::log(std::max(misfit, 1e-12));
        for (const Pair& pair : pairs_) {
            const double r = 0.5 * (balls[pair.front].radius_px + balls[pair.back].radius_px);
            const double gap =
                (balls[pair.front].centre_px.z() - balls[pair.back].centre_px.z() - pair.rise) / r;
            const double spread = gap < 0 ? options_.overlap_spread : options_.gap_spread;
            sum += 0.5 * gap * gap / (spread * spread);
        }
        return sum;
    }

    /// Ball k and those that it would run into, and so on.
    std::vector<std::size_t> pushed(const std::vector<Ball>& balls, std::size_t k,
                                    float rise) const {
        std::vector<std::size_t> group{k};
        for (std::size_t next = 0; next < group.size(); ++next) {
            for (const Pair& pair : pairs_) {
                const std::size_t other = rise > 0 ? pair.front : pair.back;
                const std::size_t own = rise > 0 ? pair.back : pair.front;
                if (own != group[next] || std::count(group.begin(), group.end(), other) > 0)
                    continue;
                const double room =
                    balls[pair.front].centre_px.z() - balls[pair.back].centre_px.z() - pair.rise;
                if (room < 0.5 * std::abs(rise)) group.push_back(other);
            }
        }
        return group;
    }

  private:
    struct Solution {
        VectorXd intensity;
        double misfit = 0;
    };

    bool has_pixels() const { return observations_.pixel.size() >= 50; }

    float rise(const std::vector<Ball>& balls, std::int16_t ball) const {
        const auto k = static_cast<std::size_t>(ball);
        return balls[k].centre_px.z() - work_.balls[k].centre_px.z();
    }

    std::vector<MatrixXd> images_of(const LitRelief& object) const {
        const LightFields fields = object.fields(directions_, true);
        std::vector<MatrixXd> images;
        for (std::size_t k = 0; k < channels_.size(); ++k) {
            images.push_back(
                operators_[k](object.bounced(fields, lights_.ball_albedo[channels_[k]])));
        }
        return images;
    }

    Solution solve(const std::vector<MatrixXd>& images) const {
        IntensityEquations equations(images[0].cols());
        for (std::size_t k = 0; k < channels_.size(); ++k)
            equations.add(images[k], y_.col(channels_[k]), weight_.col(channels_[k]));
        equations.gram.diagonal().array() += 1e-9 * equations.gram.diagonal().mean();
        const VectorXd x = solve_nnls_gram(equations.gram, equations.right).x;
        return {x, equations.misfit(x)};
    }

    /// Huber's weights, once: stems and skins must not move balls.
    void reweight(const LitRelief& object) {
        const std::vector<MatrixXd> images = images_of(object);
        const VectorXd x = solve(images).intensity;
        for (std::size_t k = 0; k < channels_.size(); ++k) {
            auto w = weight_.col(channels_[k]);
            const VectorXd residual = w.cwiseProduct(images[k] * x - y_.col(channels_[k]));
            w = w.cwiseProduct(huber_factors(residual, 1e-6).cwiseSqrt()).eval();
        }
    }

    const BallHeightOptions& options_;
    const ViewLightsEstimate& lights_;
    Relief work_;  // its balls move
    std::vector<Pair> pairs_;
    ReliefSamples samples_;
    ReliefObservations observations_;
    std::vector<Vec3> directions_;
    std::vector<int> channels_;  // those not dark
    std::vector<KernelImage> operators_;
    MatrixXd y_, weight_;
};

}  // namespace

std::vector<Ball> refine_ball_heights(const Relief& cluster, const ImageRgb& diffuse,
                                      const Mask& excluded, const ViewLightsEstimate& lights,
                                      const BallHeightOptions& options) {
    VITRINE_CHECK(cluster.is_cluster());
    Heights heights(cluster, diffuse, excluded, lights, options);
    std::vector<Ball> balls = cluster.balls;
    if (!heights.can_tell()) return balls;
    double cost = heights.cost(balls);
    for (double step = options.first_step; step >= options.last_step; step *= 0.5) {
        for (int round = 0; round < options.rounds; ++round) {
            bool has_moved = false;
            for (std::size_t k = 0; k < balls.size(); ++k) {
                for (const float side : {1.0f, -1.0f}) {
                    std::vector<Ball> trial = balls;
                    const float rise = side * static_cast<float>(step) * balls[k].radius_px;
                    for (const std::size_t j : heights.pushed(balls, k, rise))
                        trial[j].centre_px.z() += rise;
                    const double value = heights.cost(trial);
                    if (value >= cost - 0.05) continue;
                    cost = value;
                    balls = std::move(trial);
                    has_moved = true;
                    break;
                }
            }
            if (!has_moved) break;
        }
    }
    return balls;
}

}  // namespace vitrine
