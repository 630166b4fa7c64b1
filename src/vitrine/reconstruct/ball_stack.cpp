#include "reconstruct/ball_stack.h"

#include "math/statistics.h"

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include <algorithm>

namespace vitrine {
namespace {

double overlap_chord(const Ball& a, const Ball& b) {
    return (a.centre_px - b.centre_px).head<2>().norm();
}

}  // namespace

void stack_heights(std::vector<Ball>& balls, const std::vector<EdgePoint>& points, double shrink) {
    const auto count = static_cast<Eigen::Index>(balls.size());
    const auto outline_inside = [&](const Ball& own, const Ball& other) {
        const Circle circle{small_centre(own, shrink), shrink * own.radius_px, 0};
        const Vec2 centre = small_centre(other, shrink);
        int seen = 0;
        for (const EdgePoint& point : points) {
            if (lies_on(point, circle, 2.0, kAligned) &&
                (point.at - centre).norm() < shrink * other.radius_px - 2.5) {
                ++seen;
            }
        }
        return seen;
    };
    struct Pair {
        Eigen::Index front, back;
        double rise;  ///< when they touch
    };
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < balls.size(); ++i) {
        for (std::size_t j = i + 1; j < balls.size(); ++j) {
            const double reach = balls[i].radius_px + balls[j].radius_px;
            const double apart = overlap_chord(balls[i], balls[j]);
            if (apart >= reach) continue;
            bool is_first = true;
            if (!balls[j].is_mostly_hidden) {
                const int mine = outline_inside(balls[i], balls[j]);
                const int theirs = outline_inside(balls[j], balls[i]);
                if (mine == theirs) continue;
                is_first = mine > theirs;
            }
            pairs.push_back({static_cast<Eigen::Index>(is_first ? i : j),
                             static_cast<Eigen::Index>(is_first ? j : i),
                             std::sqrt(reach * reach - apart * apart)});
        }
    }
    // Least squares that take less than touching a hundred times as hard as more; held near 0.
    constexpr double kHold = 1e-3, kSolid = 100;
    Eigen::VectorXd height = Eigen::VectorXd::Zero(count);
    for (int round = 0; round < 30; ++round) {
        Eigen::MatrixXd normal = kHold * Eigen::MatrixXd::Identity(count, count);
        Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
        for (const Pair& pair : pairs) {
            const double rise = height[pair.front] - height[pair.back];
            const double weight = rise < pair.rise ? kSolid : 1.0;
            normal(pair.front, pair.front) += weight;
            normal(pair.back, pair.back) += weight;
            normal(pair.front, pair.back) -= weight;
            normal(pair.back, pair.front) -= weight;
            right[pair.front] += weight * pair.rise;
            right[pair.back] -= weight * pair.rise;
        }
        height = normal.ldlt().solve(right);
    }
    for (Eigen::Index k = 0; k < count; ++k)
        balls[static_cast<std::size_t>(k)].centre_px.z() = static_cast<float>(height[k]);
}

void add_partly_hidden(std::vector<Ball>& balls, const ImageF& small_mask,
                       const std::vector<EdgePoint>& points, double shrink) {
    constexpr double kLeastSeen = 0.03;  ///< of the disc
    constexpr double kSpillPrice = 3.0;  ///< of a pixel outside the mask, in pixels explained
    constexpr double kEdgeWorth = 0.15;  ///< of an edge point, in radii
    constexpr int kMost = 12;
    std::vector<double> sizes;
    for (const Ball& ball : balls) sizes.push_back(shrink * ball.radius_px);
    const double usual = median(sizes);
    const cv::Mat share = cv::Mat(small_mask.height(), small_mask.width(), CV_32FC1,
                                  const_cast<float*>(small_mask.data()));
    const cv::Mat outside = 1.0 - share;
    cv::Mat open = share.clone();  // what no ball covers
    const auto cover = [&](const Vec2& centre, double radius) {
        cv::circle(open,
                   cv::Point(static_cast<int>(std::lround(centre.x())),
                             static_cast<int>(std::lround(centre.y()))),
                   static_cast<int>(std::lround(radius)), cv::Scalar(0), cv::FILLED);
    };
    for (const Ball& ball : balls) cover(small_centre(ball, shrink), shrink * ball.radius_px + 1);
    std::vector<EdgePoint> left;
    for (const EdgePoint& point : points) {
        const bool is_known = std::any_of(balls.begin(), balls.end(), [&](const Ball& ball) {
            return lies_on(point, {small_centre(ball, shrink), shrink * ball.radius_px, 0}, 2.5,
                           0.85);
        });
        if (!is_known) left.push_back(point);
    }
    for (int round = 0; round < kMost; ++round) {
        double most = 0;
        Circle best;
        for (const double size : {0.8, 0.9, 1.0, 1.1}) {
            const double radius = size * usual;
            const int reach = static_cast<int>(std::ceil(radius));
            cv::Mat disc(2 * reach + 1, 2 * reach + 1, CV_32FC1, cv::Scalar(0));
            cv::circle(disc, cv::Point(reach, reach), static_cast<int>(std::lround(radius)),
                       cv::Scalar(1), cv::FILLED);
            cv::Mat seen, spilt;
            cv::filter2D(open, seen, CV_32F, disc, cv::Point(-1, -1), 0, cv::BORDER_CONSTANT);
            // Beyond the picture is outside, too.
            cv::Mat wide;
            cv::copyMakeBorder(outside, wide, reach, reach, reach, reach, cv::BORDER_CONSTANT,
                               cv::Scalar(1));
            cv::filter2D(wide, spilt, CV_32F, disc, cv::Point(-1, -1), 0, cv::BORDER_CONSTANT);
            cv::Mat edges(open.size(), CV_32FC1, cv::Scalar(0));
            for (const EdgePoint& point : left) {
                for (const double side : {1.0, -1.0}) {
                    const Vec2 c = point.at + side * radius * point.normal;
                    const cv::Point at(static_cast<int>(std::lround(c.x())),
                                       static_cast<int>(std::lround(c.y())));
                    if (at.x >= 0 && at.y >= 0 && at.x < edges.cols && at.y < edges.rows)
                        edges.at<float>(at) += 1;
                }
            }
            cv::boxFilter(edges, edges, CV_32F, cv::Size(3, 3), cv::Point(-1, -1), false);
            const double area = cv::sum(disc)[0];
            for (int y = 0; y < open.rows; ++y) {
                for (int x = 0; x < open.cols; ++x) {
                    const double explained = seen.at<float>(y, x);
                    if (explained < kLeastSeen * area) continue;
                    const double score = explained -
                                         kSpillPrice * spilt.at<float>(y + reach, x + reach) +
                                         kEdgeWorth * radius * edges.at<float>(y, x);
                    if (score <= most) continue;
                    most = score;
                    best = {Vec2(x, y), radius, explained / area};
                }
            }
        }
        if (most < kLeastSeen * kPi * usual * usual) break;
        balls.push_back({Vec3f(static_cast<float>(to_full(best.centre.x(), shrink)),
                               static_cast<float>(-to_full(best.centre.y(), shrink)), 0),
                         static_cast<float>(best.radius / shrink), Vec2f::Zero(), true});
        cover(best.centre, best.radius + 1);
        std::erase_if(left,
                      [&](const EdgePoint& point) { return lies_on(point, best, 2.5, 0.85); });
    }
}

}  // namespace vitrine
