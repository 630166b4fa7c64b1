#include "estimate/few_lamps.h"

#include "base/error.h"
#include "base/parallel.h"
#include "estimate/profile_fit.h"
#include "math/nnls.h"

namespace vitrine {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kChannels = 3;
/// Kernels and intensities in turn, from each start.
constexpr int kTurns = 6;
/// A picture's value below this share of its mean weighs no more than that.
constexpr double kDarkest = 0.2;
/// Of the brightest channel, for the gain of closed bodies.
constexpr double kBrightestAlbedo = 0.7;
/// Of that, what balls throw on each other: they see less of each other's lit sides than the guess
/// of what lies behind says, or more. The first is where the search starts.
constexpr double kBounceShares[] = {0.5, 0.0, 0.25, 0.75, 1.0};
constexpr double kUsualBounce = kBounceShares[0];

TwoExponentials single_exponential(double length) {
    return {1 / (2 * kPi * length * length), -1 / length, 0, -1 / length};
}

/// Images of the unit lights in one channel: one matrix (observations x lights) per length.
using LengthImages = std::vector<MatrixXd>;

class Fit {
  public:
    Fit(const LitRelief& object, const LightPaths& paths, const MatrixXd& exitance,
        const Rgbd& ground_colour, const std::vector<LampVote>& votes,
        const FewLampsOptions& options)
        : object_(object),
          paths_(paths),
          ground_colour_(ground_colour),
          votes_(votes),
          options_(options),
          y_(exitance),
          lengths_(length_grid(options.shortest_px, options.longest_px, options.length_count)) {
        weight_ = MatrixXd::Zero(y_.rows(), kChannels);
        for (int c = 0; c < kChannels; ++c) {
            mean_[c] = y_.col(c).mean();
            if (mean_[c] <= 0) continue;
            y_.col(c) /= mean_[c];
            weight_.col(c) = y_.col(c).cwiseMax(kDarkest).cwiseInverse();
        }
        base_weight_ = weight_;
        set_bodies(
            RgbExponentials{single_exponential(1), single_exponential(1), single_exponential(1)});
    }

    /// Kernels and intensities for given directions, from every length as a start.
    FewLamps fit_kernels(const std::vector<Vec3>& directions,
                         const std::vector<SeenAt>& seen_at) const {
        const LightFields fields = object_.fields(directions, true);
        std::vector<RadialKernel> exponentials;
        for (const double length : lengths_) exponentials.push_back(plain_exponential(length));
        std::array<LengthImages, kChannels> images;
        for (std::size_t c = 0; c < kChannels; ++c) {
            images[c] = paths_.images(exponentials, bounced(fields, c), body_[c]);
            for (MatrixXd& image : images[c])
                image.rightCols<1>() *= ground_colour_[static_cast<int>(c)];
        }
        FewLamps best;
        for (const double length : lengths_) {
            FewLamps trial;
            trial.directions = directions;
            trial.seen_at = seen_at;
            trial.kernel.fill(single_exponential(length));
            for (int turn = 0; turn < kTurns; ++turn) {
                solve_intensities(images_of(images, trial.kernel), trial);
                fit_lengths(images, trial);
            }
            solve_intensities(images_of(images, trial.kernel), trial);
            if (trial.misfit < best.misfit) best = trial;
        }
        return best;
    }

    /// Huber's weights from what `lamps` leaves: creases, ears and texture must not steer lamps.
    void reweight(const FewLamps& lamps) {
        const std::array<MatrixXd, kChannels> images = kernel_images(lamps, operators_of(lamps));
        for (int c = 0; c < kChannels; ++c) {
            if (mean_[c] <= 0) continue;
            const VectorXd residual =
                base_weight_.col(c).cwiseProduct(images[c] * lamps.intensity - y_.col(c));
            weight_.col(c) =
                base_weight_.col(c).cwiseProduct(huber_factors(residual, 1e-6).cwiseSqrt());
        }
    }

    /// How much more a closed body passes, and what balls throw on each other, follows from the
    /// albedos, up to the common factor.
    void set_bodies(const RgbExponentials& kernel) {
        std::array<double, kChannels> albedo{};
        double brightest = 1e-12;
        for (int c = 0; c < kChannels; ++c) {
            albedo[c] = kernel[c].total() * mean_[c];
            brightest = std::max(brightest, albedo[c]);
        }
        for (int c = 0; c < kChannels; ++c) {
            albedo_[c] = kBrightestAlbedo * albedo[c] / brightest;
            body_[c] =
                options_.use_curved_body ? curved_body_factor(albedo_[c]) : CurvedBodyFactor{};
        }
    }

    /// Moves the directions to where the misfit is least, kernels kept; those of highlights not
    /// far.
    void move(FewLamps& lamps, double first_step_deg) const {
        const std::vector<KernelImage> operators = operators_of(lamps);
        std::array<MatrixXd, kChannels> images = kernel_images(lamps, operators);
        solve_intensities(images, lamps);
        const auto try_move = [&](std::size_t l, const Vec3& direction) {
            const double reach = radians(options_.held_reach_deg);
            if (lamps.seen_at[l] && angle_between(direction, *lamps.seen_at[l]) > reach)
                return false;
            FewLamps trial = lamps;
            trial.directions[l] = direction;
            const LightFields fields = object_.fields({direction}, false);
            std::array<MatrixXd, kChannels> moved = images;
            for (std::size_t c = 0; c < kChannels; ++c)
                moved[c].col(static_cast<Index>(l)) = operators[c](bounced(fields, c)).col(0);
            solve_intensities(moved, trial);
            if (cost(trial) >= cost(lamps) - 5e-4 * options_.looks) return false;
            lamps = std::move(trial);
            images = std::move(moved);
            return true;
        };
        for (double step = radians(first_step_deg); step > radians(1.0); step *= 0.5) {
            for (int round = 0; round < 4; ++round) {
                bool has_moved = false;
                for (std::size_t l = 0; l < lamps.directions.size(); ++l) {
                    const Vec3 centre = lamps.directions[l];
                    const Vec3 side = centre.unitOrthogonal(), up = centre.cross(side);
                    for (int k = 0; k < 6; ++k) {
                        const double turn = k * kPi / 3;
                        has_moved |= try_move(
                            l, std::cos(step) * centre +
                                   std::sin(step) * (std::cos(turn) * side + std::sin(turn) * up));
                    }
                }
                if (!has_moved) break;
            }
        }
    }

    /// Minus the log-likelihood, up to a constant (few_lamps.h).
    double cost(const FewLamps& lamps) const {
        const auto count = static_cast<double>(lamps.directions.size());
        double sum = 0.5 * options_.looks * std::log(std::max(lamps.misfit, 1e-12)) +
                     options_.lamp_cost * count;
        for (const LampVote& vote : votes_) {
            const double kappa = vote.concentration;
            double density = 0;  // over that of a vote from anywhere
            for (const Vec3& direction : lamps.directions)
                density += 2 * kappa / (1 - std::exp(-2 * kappa)) *
                           std::exp(kappa * (vote.direction.dot(direction) - 1));
            sum -= vote.weight *
                   std::log(options_.false_votes + (1 - options_.false_votes) * density / count);
        }
        return sum;
    }

    /// How strongly balls light each other explains the picture best; kernels and directions kept.
    void fit_bounce(FewLamps& lamps) {
        if (!object_.is_cluster()) return;
        const std::vector<KernelImage> operators = operators_of(lamps);
        FewLamps best;
        double best_share = bounce_share_;
        for (const double share : kBounceShares) {
            bounce_share_ = share;
            FewLamps trial = lamps;
            solve_intensities(kernel_images(trial, operators), trial);
            if (trial.misfit >= best.misfit) continue;
            best = std::move(trial);
            best_share = share;
        }
        bounce_share_ = best_share;
        lamps = std::move(best);
    }

    Rgbd ball_albedo() const { return bounce_share_ * albedo_; }

    double relative_residual(const FewLamps& lamps) const {
        const std::array<MatrixXd, kChannels> images = kernel_images(lamps, operators_of(lamps));
        double sum = 0, count = 0;
        for (int c = 0; c < kChannels; ++c) {
            if (mean_[c] <= 0) continue;
            sum += base_weight_.col(c)
                       .cwiseProduct(images[c] * lamps.intensity - y_.col(c))
                       .squaredNorm();
            count += static_cast<double>(y_.rows());
        }
        return std::sqrt(sum / std::max(count, 1.0));
    }

  private:
    LightFields bounced(const LightFields& fields, std::size_t channel) const {
        return object_.bounced(fields, bounce_share_ * albedo_[static_cast<int>(channel)]);
    }

    std::array<MatrixXd, kChannels> images_of(const std::array<LengthImages, kChannels>& images,
                                              const RgbExponentials& kernel) const {
        std::array<MatrixXd, kChannels> result;
        for (std::size_t c = 0; c < kChannels; ++c) {
            result[c] = MatrixXd::Zero(images[c][0].rows(), images[c][0].cols());
            for (std::size_t i = 0; i < lengths_.size(); ++i) {
                if (kernel[c].a > 0 && kernel[c].b == -1 / lengths_[i])
                    result[c] += kernel[c].a * images[c][i];
                if (kernel[c].c > 0 && kernel[c].d == -1 / lengths_[i])
                    result[c] += kernel[c].c * images[c][i];
            }
        }
        return result;
    }

    std::vector<KernelImage> operators_of(const FewLamps& lamps) const {
        std::vector<KernelImage> operators;
        for (std::size_t c = 0; c < kChannels; ++c)
            operators.emplace_back(paths_, lamps.kernel[c], body_[c]);
        return operators;
    }

    std::array<MatrixXd, kChannels> kernel_images(const FewLamps& lamps,
                                                  const std::vector<KernelImage>& operators) const {
        const LightFields fields = object_.fields(lamps.directions, true);
        std::array<MatrixXd, kChannels> images;
        for (std::size_t c = 0; c < kChannels; ++c) {
            images[c] = operators[c](bounced(fields, c));
            images[c].rightCols<1>() *= ground_colour_[static_cast<int>(c)];
        }
        return images;
    }

    /// Non-negative least squares over all channels at once; sets the misfit too.
    void solve_intensities(const std::array<MatrixXd, kChannels>& images, FewLamps& lamps) const {
        const Index count = images[0].cols();
        IntensityEquations equations(count);
        for (std::size_t c = 0; c < kChannels; ++c) {
            const auto column = static_cast<Index>(c);
            equations.add(images[c], y_.col(column), weight_.col(column));
        }
        MatrixXd& gram = equations.gram;
        const double scale = gram.diagonal().cwiseSqrt().mean();
        for (Index l = 0; l < count; ++l) {
            double price = options_.ground_price;
            if (l < count - 2) {
                const auto lamp = static_cast<std::size_t>(l);
                price = options_.lamp_price * (1 + 3 * std::max(0.0, -lamps.directions[lamp].z()));
                if (lamps.seen_at[lamp]) price = 0;
            } else if (l == count - 2) {
                price = options_.ambient_price;
            }
            gram(l, l) += price * scale * price * scale;
        }
        lamps.intensity = solve_nnls_gram(gram, equations.right).x;
        lamps.misfit = equations.misfit(lamps.intensity);
    }

    void fit_lengths(const std::array<LengthImages, kChannels>& images, FewLamps& lamps) const {
        for (std::size_t c = 0; c < kChannels; ++c) {
            if (mean_[c] <= 0) continue;
            MatrixXd lit(y_.rows(), static_cast<Index>(lengths_.size()));
            for (std::size_t i = 0; i < lengths_.size(); ++i)
                lit.col(static_cast<Index>(i)) = images[c][i] * lamps.intensity;
            const auto column = static_cast<Index>(c);
            lamps.kernel[c] =
                best_pair(lit, y_.col(column), weight_.col(column).cwiseAbs2(), lengths_);
        }
    }

    const LitRelief& object_;
    const LightPaths& paths_;
    Rgbd ground_colour_;
    const std::vector<LampVote>& votes_;
    const FewLampsOptions& options_;
    MatrixXd y_;  // exitance over its mean
    std::array<double, kChannels> mean_{};
    MatrixXd base_weight_, weight_;  // square roots
    std::vector<double> lengths_;
    std::array<CurvedBodyFactor, kChannels> body_;
    Rgbd albedo_ = Rgbd::Zero();
    double bounce_share_ = kUsualBounce;  // of it, that balls throw on each other
};

/// Takes away the lamps that the picture hardly misses.
void drop_needless(const Fit& fit, FewLamps& lamps) {
    for (std::size_t l = lamps.directions.size(); l-- > 0;) {
        if (lamps.seen_at[l] || lamps.directions.size() == 1) continue;
        std::vector<Vec3> fewer = lamps.directions;
        std::vector<SeenAt> seen_at = lamps.seen_at;
        fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(l));
        seen_at.erase(seen_at.begin() + static_cast<std::ptrdiff_t>(l));
        FewLamps without = fit.fit_kernels(fewer, seen_at);
        if (fit.cost(without) <= fit.cost(lamps)) lamps = std::move(without);
    }
}

/// Two lamps side by side are mostly one, split by a shape that does not quite explain its
/// shading: they are joined where the misfit hardly grows.
void join_neighbours(const Fit& fit, FewLamps& lamps, const FewLampsOptions& options) {
    const auto joined_pair = [&]() -> std::optional<FewLamps> {
        for (std::size_t i = 0; i < lamps.directions.size(); ++i) {
            for (std::size_t j = i + 1; j < lamps.directions.size(); ++j) {
                const Vec3 &a = lamps.directions[i], &b = lamps.directions[j];
                if (lamps.seen_at[i] || lamps.seen_at[j]) continue;
                if (angle_between(a, b) > radians(options.join_deg)) continue;
                std::vector<Vec3> fewer = lamps.directions;
                std::vector<SeenAt> seen_at = lamps.seen_at;
                fewer[i] = (lamps.intensity[static_cast<Index>(i)] * a +
                            lamps.intensity[static_cast<Index>(j)] * b)
                               .normalized();
                fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(j));
                seen_at.erase(seen_at.begin() + static_cast<std::ptrdiff_t>(j));
                FewLamps joined = fit.fit_kernels(fewer, seen_at);
                if (options.first_step_deg > 0) fit.move(joined, options.first_step_deg);
                if (fit.cost(joined) <= fit.cost(lamps)) return joined;
            }
        }
        return {};
    };
    while (const std::optional<FewLamps> joined = joined_pair()) lamps = *joined;
}

/// Kernels and weights under the directions as they are.
void settle(Fit& fit, FewLamps& lamps) {
    fit.set_bodies(lamps.kernel);
    fit.fit_bounce(lamps);
    fit.reweight(lamps);
    lamps = fit.fit_kernels(lamps.directions, lamps.seen_at);
}

/// A start with its own weights.
struct Candidate {
    Fit fit;
    FewLamps lamps;
    double cost = 0;  ///< comparable between candidates: without their weights
};

double cost_without_weights(const Fit& fit, FewLamps lamps) {
    lamps.misfit = std::pow(fit.relative_residual(lamps), 2);
    return fit.cost(lamps);
}

void polish(Candidate& candidate, const FewLampsOptions& options) {
    Fit& fit = candidate.fit;
    FewLamps& lamps = candidate.lamps;
    if (options.first_step_deg > 0) fit.move(lamps, options.first_step_deg);
    settle(fit, lamps);
    drop_needless(fit, lamps);
    join_neighbours(fit, lamps, options);
    if (options.first_step_deg > 0) {
        fit.move(lamps, 0.5 * options.first_step_deg);
        settle(fit, lamps);
    }
    lamps.relative_residual = fit.relative_residual(lamps);
}

}  // namespace

FewLamps fit_few_lamps(const LitRelief& object, const MatrixXd& exitance, const Rgbd& ground_colour,
                       const std::vector<LampStart>& starts, const std::vector<LampVote>& votes,
                       const FewLampsOptions& options) {
    VITRINE_CHECK(!starts.empty());
    const LightPaths paths(object);
    std::vector<Candidate> candidates(
        starts.size(),
        {Fit(object, paths, exitance, ground_colour, votes, options), FewLamps(), 0});
    parallel_for(starts.size(), 1, [&](std::size_t k) {
        auto& [fit, lamps, cost] = candidates[k];
        lamps = fit.fit_kernels(starts[k].directions, starts[k].seen_at);
        settle(fit, lamps);
        cost = cost_without_weights(fit, lamps);
    });
    Candidate& best =
        *std::min_element(candidates.begin(), candidates.end(),
                          [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
    polish(best, options);
    best.lamps.ball_albedo = best.fit.ball_albedo();
    return best.lamps;
}

}  // namespace vitrine
