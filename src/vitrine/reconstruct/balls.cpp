#include "reconstruct/balls.h"

#include "base/error.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/poisson.h"
#include "reconstruct/ball_stack.h"

#include <Eigen/QR>
#include <opencv2/imgproc.hpp>

#include <numeric>

namespace vitrine {
namespace {

constexpr double kWorkRadius = 40;   ///< inradius in pixels at which the search runs
constexpr double kFineRadius = 110;  ///< the same, at which circles are sharpened
constexpr int kBins = 48;            ///< of a circle, for its support

cv::Mat to_cv(const ImageF& image) {
    return cv::Mat(image.height(), image.width(), CV_32FC1, const_cast<float*>(image.data()))
        .clone();
}

ImageF to_image(const cv::Mat& values) {
    ImageF image(values.cols, values.rows);
    for (int y = 0; y < values.rows; ++y)
        for (int x = 0; x < values.cols; ++x) image(x, y) = values.at<float>(y, x);
    return image;
}

/// Ridges of the gradient above `threshold` (per pixel).
void add_edges(cv::Mat field, double threshold, std::vector<EdgePoint>& points,
               const cv::Mat& allowed) {
    cv::GaussianBlur(field, field, cv::Size(), 1.0);
    cv::Mat gx, gy, strength;
    cv::Sobel(field, gx, CV_32F, 1, 0, 3, 1.0 / 8);
    cv::Sobel(field, gy, CV_32F, 0, 1, 3, 1.0 / 8);
    cv::magnitude(gx, gy, strength);
    const auto sample = [&](double x, double y) -> double {
        const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
        const double u = x - x0, v = y - y0;
        const auto at = [&](int column, int row) {
            return static_cast<double>(strength.at<float>(
                std::clamp(row, 0, strength.rows - 1), std::clamp(column, 0, strength.cols - 1)));
        };
        return (1 - v) * ((1 - u) * at(x0, y0) + u * at(x0 + 1, y0)) +
               v * ((1 - u) * at(x0, y0 + 1) + u * at(x0 + 1, y0 + 1));
    };
    for (int y = 0; y < field.rows; ++y) {
        for (int x = 0; x < field.cols; ++x) {
            const double value = strength.at<float>(y, x);
            if (value <= threshold || allowed.at<std::uint8_t>(y, x) == 0) continue;
            const Vec2 n(gx.at<float>(y, x) / value, gy.at<float>(y, x) / value);
            if (value < sample(x + n.x(), y + n.y()) || value < sample(x - n.x(), y - n.y()))
                continue;
            points.push_back({Vec2(x, y), n});
        }
    }
}

/// The circle with most votes: every edge votes for centres along its normal.
Circle most_voted(const std::vector<EdgePoint>& points, const std::vector<double>& radii, int width,
                  int height) {
    Circle best;
    std::vector<cv::Mat> votes;
    for (const double radius : radii) {
        cv::Mat vote(height, width, CV_32FC1, cv::Scalar(0));
        // Longer circles are the stronger evidence at equal share.
        const auto weight =
            static_cast<float>(std::sqrt(radius / kWorkRadius) / (2 * kPi * radius));
        for (const EdgePoint& point : points) {
            if (point.is_used) continue;
            for (const double side : {1.0, -1.0}) {
                const Vec2 c = point.at + side * radius * point.normal;
                const int x = static_cast<int>(std::lround(c.x()));
                const int y = static_cast<int>(std::lround(c.y()));
                if (x >= 0 && y >= 0 && x < width && y < height) vote.at<float>(y, x) += weight;
            }
        }
        cv::GaussianBlur(vote, vote, cv::Size(), 1.2);
        votes.push_back(vote);
    }
    double most = 0;
    for (std::size_t k = 1; k + 1 < radii.size(); ++k) {
        const cv::Mat smooth = 0.25 * votes[k - 1] + 0.5 * votes[k] + 0.25 * votes[k + 1];
        double value = 0;
        cv::Point place;
        cv::minMaxLoc(smooth, nullptr, &value, nullptr, &place);
        if (value <= most) continue;
        most = value;
        best = {Vec2(place.x, place.y), radii[k], 0};
    }
    return best;
}

/// Least squares on the edge points that follow the circle, then its support.
Circle refined(Circle circle, const std::vector<EdgePoint>& points) {
    for (int round = 0; round < 4; ++round) {
        std::vector<Vec2> on;
        for (const EdgePoint& point : points)
            if (!point.is_used && lies_on(point, circle, 2.5, kAligned)) on.push_back(point.at);
        if (on.size() < 6) break;
        Eigen::MatrixXd a(static_cast<Eigen::Index>(on.size()), 3);
        Eigen::VectorXd b(a.rows());
        for (std::size_t i = 0; i < on.size(); ++i) {
            const auto row = static_cast<Eigen::Index>(i);
            a.row(row) << 2 * on[i].x(), 2 * on[i].y(), 1;
            b[row] = on[i].squaredNorm();
        }
        const Eigen::Vector3d x = a.colPivHouseholderQr().solve(b);
        const double radius = std::sqrt(std::max(1.0, x[2] + x.head<2>().squaredNorm()));
        if (std::abs(radius - circle.radius) > 3) break;
        circle.centre = x.head<2>();
        circle.radius = radius;
    }
    std::array<bool, kBins> is_seen{};
    for (const EdgePoint& point : points) {
        if (point.is_used || !lies_on(point, circle, 2.0, kAligned)) continue;
        const Vec2 v = point.at - circle.centre;
        const double turn = (std::atan2(v.y(), v.x()) + kPi) / (2 * kPi);
        is_seen[std::min<std::size_t>(static_cast<std::size_t>(turn * kBins), kBins - 1)] = true;
    }
    circle.support = static_cast<double>(std::count(is_seen.begin(), is_seen.end(), true)) / kBins;
    return circle;
}

/// Edges of the border of the mask and, inside, of the picture.
std::vector<EdgePoint> edges_of(const cv::Mat& lab, const cv::Mat& share, double shrink,
                                cv::Mat& small_mask) {
    cv::Mat small_lab, well_inside;
    cv::resize(lab, small_lab, cv::Size(), shrink, shrink, cv::INTER_AREA);
    cv::resize(share, small_mask, cv::Size(), shrink, shrink, cv::INTER_AREA);
    const cv::Mat whole(small_mask.size(), CV_8UC1, cv::Scalar(255));
    cv::erode(small_mask > 0.5, well_inside, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
    std::vector<EdgePoint> points;
    add_edges(small_mask.clone(), 0.1, points, whole);
    for (EdgePoint& point : points) point.is_border = true;
    cv::Mat planes[3];
    cv::split(small_lab, planes);
    // Steps of Lab per working pixel: a few times what shading of a round body shows.
    const double thresholds[3] = {0.7, 0.9, 1.25};
    for (int c = 0; c < 3; ++c) add_edges(planes[c], thresholds[c], points, well_inside);
    return points;
}

/// How far from round the outline is (Ball::oval), with the circle's own corrections: least squares
/// on the radii of its edges, ovals of more than 5 % unlikely. Moves the circle.
Vec2f fit_oval(Circle& circle, const std::vector<EdgePoint>& points) {
    using Vec5 = Eigen::Matrix<double, 5, 1>;
    constexpr double kReach = 0.09, kScatter = 0.03, kUsualOval = 0.05;
    Vec5 x = Vec5::Zero();
    for (int round = 0; round < 3; ++round) {
        Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
        Vec5 right = Vec5::Zero();
        // An outline gives a few dozen independent looks, however many edge points there are.
        double on = 0;
        for (const EdgePoint& point : points) {
            if (!lies_on(point, circle, kReach * circle.radius, 0.9)) continue;
            const Vec2 v = point.at - circle.centre;
            const double t = std::atan2(-v.y(), v.x()), size = v.norm() / circle.radius - 1;
            Vec5 row;
            row << std::cos(t), std::sin(t), 1, std::cos(2 * t), std::sin(2 * t);
            const double off = (size - row.dot(x)) / kScatter;
            const double weight = (point.is_border ? 4.0 : 1.0) / (1 + off * off);
            normal += weight * row * row.transpose();
            right += weight * size * row;
            on += weight;
        }
        if (on < 12) return Vec2f::Zero();
        constexpr double kLooks = 40;
        normal *= kLooks / on;
        right *= kLooks / on;
        normal.diagonal().tail<2>().array() += std::pow(kScatter / kUsualOval, 2);
        x = normal.ldlt().solve(right);
    }
    if (x.head<3>().norm() > 0.06 || x.tail<2>().norm() > 0.15) return Vec2f::Zero();
    circle.centre += circle.radius * Vec2(x[0], -x[1]);
    circle.radius *= 1 + x[2];
    return x.tail<2>().cast<float>();
}

/// The circle again at finer resolution, ever closer to its edges. The object's border is the
/// surest outline; edges of highlights and shadows beside it must not pull.
Ball sharpened(const Ball& ball, const std::vector<EdgePoint>& points, double shrink) {
    Circle circle{small_centre(ball, shrink), shrink * ball.radius_px, 0};
    for (const double tolerance : {0.07, 0.045, 0.03, 0.03}) {
        Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
        Eigen::Vector3d right = Eigen::Vector3d::Zero();
        int on = 0;
        for (const EdgePoint& point : points) {
            if (!lies_on(point, circle, tolerance * circle.radius + 0.5, 0.95)) continue;
            const double weight = point.is_border ? 4.0 : 1.0;
            const Eigen::Vector3d row(2 * point.at.x(), 2 * point.at.y(), 1);
            normal += weight * row * row.transpose();
            right += weight * point.at.squaredNorm() * row;
            ++on;
        }
        if (on < 12) return ball;
        const Eigen::Vector3d x = normal.ldlt().solve(right);
        const double radius = std::sqrt(std::max(1.0, x[2] + x.head<2>().squaredNorm()));
        if (std::abs(radius - circle.radius) > 0.1 * circle.radius) return ball;
        circle.centre = x.head<2>();
        circle.radius = radius;
    }
    const Vec2f oval = fit_oval(circle, points);
    return {Vec3f(static_cast<float>(to_full(circle.centre.x(), shrink)),
                  static_cast<float>(-to_full(circle.centre.y(), shrink)), ball.centre_px.z()),
            static_cast<float>(circle.radius / shrink), oval};
}

}  // namespace

std::vector<Ball> find_balls(const ImageRgb& picture, const Mask& mask,
                             const BallOptions& options) {
    VITRINE_CHECK(mask.same_size(picture));
    float radius_px = 0;
    for (const float d : distance_to(mask_not(mask))) radius_px = std::max(radius_px, d);
    radius_px = std::min(radius_px, static_cast<float>(std::max(mask.width(), mask.height())));
    if (radius_px < 12) return {};
    const double shrink = std::min(1.0, kWorkRadius / radius_px);

    // Inside the mask only: the border itself is an edge of its own, of full strength.
    const Mask inner = erode(mask, 2);
    if (count_inside(inner) == 0) return {};
    const ImageRgb extended = extend_nearest(picture, inner);
    std::vector<double> luminances;
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (inner[i] > 127) luminances.push_back(luminance(picture[i]));
    std::nth_element(luminances.begin(),
                     luminances.begin() + static_cast<std::ptrdiff_t>(luminances.size() * 9 / 10),
                     luminances.end());
    const double bright = std::max(luminances[luminances.size() * 9 / 10], 1e-9);
    cv::Mat encoded(mask.height(), mask.width(), CV_32FC3);
    for (int y = 0; y < mask.height(); ++y) {
        for (int x = 0; x < mask.width(); ++x) {
            for (int c = 0; c < 3; ++c) {
                encoded.at<cv::Vec3f>(y, x)[c] = std::min(
                    1.0f, linear_to_srgb(static_cast<float>(0.6 * extended(x, y)[c] / bright)));
            }
        }
    }
    cv::Mat lab;
    cv::cvtColor(encoded, lab, cv::COLOR_RGB2Lab);  // L 0 to 100
    ImageF share(mask.width(), mask.height());
    for (std::size_t i = 0; i < mask.size(); ++i) share[i] = mask[i] > 127 ? 1.0f : 0.0f;
    cv::Mat small_mask;
    const std::vector<EdgePoint> points = edges_of(lab, to_cv(share), shrink, small_mask);

    std::vector<double> radii;
    for (double r = options.min_radius * kWorkRadius; r < options.max_radius * kWorkRadius;
         r += 1.5)
        radii.push_back(r);
    std::vector<Ball> balls;
    cv::Mat covered(small_mask.size(), CV_8UC1, cv::Scalar(0));
    std::vector<EdgePoint> left = points;
    constexpr int kMaxTries = 40;
    for (int attempt = 0; attempt < kMaxTries; ++attempt) {
        const Circle circle =
            refined(most_voted(left, radii, small_mask.cols, small_mask.rows), left);
        if (circle.radius <= 0 || circle.support < 0.6 * options.min_support) break;
        for (EdgePoint& point : left)
            if (lies_on(point, circle, 2.5, 0.85)) point.is_used = true;
        cv::Mat disc(small_mask.size(), CV_8UC1, cv::Scalar(0));
        cv::circle(disc,
                   cv::Point(static_cast<int>(std::lround(circle.centre.x())),
                             static_cast<int>(std::lround(circle.centre.y()))),
                   static_cast<int>(std::lround(circle.radius)), cv::Scalar(255), cv::FILLED);
        const double inside = cv::mean(small_mask, disc)[0];
        if (circle.support < options.min_support || inside < 0.75) continue;
        cv::bitwise_or(covered, disc, covered);
        balls.push_back({Vec3f(static_cast<float>(to_full(circle.centre.x(), shrink)),
                               static_cast<float>(-to_full(circle.centre.y(), shrink)), 0),
                         static_cast<float>(circle.radius / shrink)});
    }
    const double object = cv::sum(small_mask)[0];
    cv::Mat covered_share;
    small_mask.copyTo(covered_share, covered);
    const double cover = object > 0 ? cv::sum(covered_share)[0] / object : 0;
    if (static_cast<int>(balls.size()) < options.min_count || cover < options.min_cover) return {};
    const double fine_shrink = std::min(1.0, kFineRadius / radius_px);
    cv::Mat unused;
    const std::vector<EdgePoint> fine = edges_of(lab, to_cv(share), fine_shrink, unused);
    for (Ball& ball : balls) ball = sharpened(ball, fine, fine_shrink);
    add_partly_hidden(balls, to_image(small_mask), points, shrink);
    stack_heights(balls, points, shrink);
    return balls;
}

namespace {

/// A bunch goes on behind what is seen of it. Balls at its outline lie about in the middle of its
/// depth; those in front of them have likenesses behind.
std::vector<Ball> unseen_behind(const Relief& relief, const std::vector<Ball>& balls) {
    const ImageF inside = distance_to(mask_not(relief.mask));
    std::vector<double> on_outline(balls.size(), 0.0);
    for (std::size_t i = 0; i < inside.size(); ++i) {
        const std::int16_t ball = relief.ball_of[i];
        if (ball >= 0 && inside[i] > 0 && inside[i] < 1.5f)
            on_outline[static_cast<std::size_t>(ball)] += 1;
    }
    double sum = 0, weight = 0;
    for (std::size_t k = 0; k < balls.size(); ++k) {
        sum += on_outline[k] * balls[k].centre_px.z();
        weight += on_outline[k];
    }
    const auto middle = static_cast<float>(sum / std::max(weight, 1.0));
    std::vector<Ball> unseen;
    for (const Ball& ball : balls) {
        const float before = ball.centre_px.z() - middle;
        if (before < 0.5f * ball.radius_px) continue;
        unseen.push_back(ball);
        unseen.back().centre_px.z() = middle - before;
    }
    return unseen;
}

}  // namespace

Relief relief_of_balls(const Mask& mask, std::vector<Ball> balls) {
    VITRINE_CHECK(!balls.empty());
    Relief relief;
    relief.mask = mask;
    relief.depth_px = ImageF(mask.width(), mask.height());
    relief.normals = Image<Vec3f>(mask.width(), mask.height(), Vec3f(0, 0, 1));
    relief.ball_of = Image<std::int16_t>(mask.width(), mask.height(), -1);
    // The unit of lengths is a typical ball, not the cluster.
    std::vector<float> radii;
    for (const Ball& ball : balls) radii.push_back(ball.radius_px);
    std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2),
                     radii.end());
    relief.inradius_px = radii[radii.size() / 2];
    for (int y = 0; y < mask.height(); ++y) {
        for (int x = 0; x < mask.width(); ++x) {
            if (!is_inside(mask, x, y)) continue;
            float highest = -1e30f, nearest = 1e30f;
            for (std::size_t k = 0; k < balls.size(); ++k) {
                const Ball& ball = balls[k];
                Eigen::Matrix2f round;  // takes the oval outline to the circle
                round << 1 + ball.oval.x(), ball.oval.y(), ball.oval.y(), 1 - ball.oval.x();
                round = round.inverse().eval();
                const Vec2f v = round * Vec2f(static_cast<float>(x) - ball.centre_px.x(),
                                              static_cast<float>(-y) - ball.centre_px.y());
                const float rest = ball.radius_px * ball.radius_px - v.squaredNorm();
                if (rest > 0) {
                    const float z = ball.centre_px.z() + std::sqrt(rest);
                    if (z <= highest) continue;
                    highest = z;
                    relief.ball_of(x, y) = static_cast<std::int16_t>(k);
                    relief.depth_px(x, y) = z;
                    const Vec2f n = round * v;
                    relief.normals(x, y) = Vec3f(n.x(), n.y(), std::sqrt(rest)).normalized();
                } else if (relief.ball_of(x, y) < 0) {
                    const float gap = v.norm() - ball.radius_px;
                    if (gap >= nearest) continue;
                    nearest = gap;
                    relief.depth_px(x, y) = ball.centre_px.z();
                    relief.normals(x, y) = Vec3f(v.x(), v.y(), 0.2f * ball.radius_px).normalized();
                }
            }
        }
    }
    relief.unseen_balls = unseen_behind(relief, balls);
    relief.balls = std::move(balls);
    return relief;
}

}  // namespace vitrine
