#include "optics/radial_profile.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>

namespace vitrine {

double TwoExponentials::operator()(double r) const {
    return a * std::exp(b * r) + c * std::exp(d * r);
}

double TwoExponentials::total() const { return 2.0 * kPi * (a / (b * b) + c / (d * d)); }

double TwoExponentials::cumulative(double r) const {
    // int_0^R 2 pi r e^{b r} dr = 2 pi (1 - e^{bR} (1 - bR)) / b^2
    const auto within = [&](double rate) {
        return 2.0 * kPi * (1.0 - std::exp(rate * r) * (1.0 - rate * r)) / (rate * rate);
    };
    return a * within(b) + c * within(d);
}

double TwoExponentials::mean_radius() const {
    const double sum = total();
    if (sum <= 0) return 0.0;
    return 4.0 * kPi * (a / (-b * b * b) + c / (-d * d * d)) / sum;
}

double TwoExponentials::half_radius() const {
    const double sum = total();
    if (sum <= 0) return 0.0;
    double low = 0.0, high = 60.0 / std::min(-b, -d);
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (cumulative(middle) < 0.5 * sum ? low : high) = middle;
    }
    return low;
}

TwoExponentials TwoExponentials::scaled(double factor) const {
    const double area = factor * factor;
    return {a / area, b / factor, c / area, d / factor};
}

TwoExponentials random_walk_profile(double albedo, double mean_radius) {
    // Minimax over the cumulative albedo; lengths in mean radii of the exact profile.
    constexpr double kNearShare = 0.433, kNear = 0.200, kFar = 0.795;
    const double near = kNear * mean_radius, far = kFar * mean_radius;
    return {kNearShare * albedo / (2 * kPi * near * near), -1 / near,
            (1 - kNearShare) * albedo / (2 * kPi * far * far), -1 / far};
}

Rgbd RadialProfile::at(double radius) const {
    VITRINE_CHECK_EQ(r.size(), rd.size());
    if (r.empty() || radius > r.back()) return Rgbd::Zero();
    if (radius <= r.front()) return rd.front();
    const auto upper =
        static_cast<std::size_t>(std::upper_bound(r.begin(), r.end(), radius) - r.begin());
    if (upper == r.size()) return rd.back();
    const double t = (radius - r[upper - 1]) / (r[upper] - r[upper - 1]);
    Rgbd value;
    for (int c = 0; c < 3; ++c) {
        const double low = rd[upper - 1][c], high = rd[upper][c];
        value[c] = low > 0 && high > 0 ? std::exp((1 - t) * std::log(low) + t * std::log(high))
                                       : (1 - t) * low + t * high;
    }
    return value;
}

Rgbd RadialProfile::cumulative(double radius) const {
    return cumulative(std::span(&radius, 1)).front();
}

std::vector<Rgbd> RadialProfile::cumulative(std::span<const double> radii) const {
    const auto between = [&](double from, double to) {
        const int steps = 4;
        Rgbd sum = Rgbd::Zero();
        for (int i = 0; i < steps; ++i) {  // Simpson on a quarter of the interval
            const double x0 = from + (to - from) * i / steps;
            const double x1 = from + (to - from) * (i + 1) / steps;
            const double xm = 0.5 * (x0 + x1);
            sum += 2.0 * kPi * (x1 - x0) / 6.0 *
                   (x0 * at(x0) + 4.0 * xm * at(xm) + x1 * at(std::min(x1, r.back())));
        }
        return sum;
    };
    std::vector<Rgbd> result;
    Rgbd sum = Rgbd::Zero();  // within `from`
    double from = 0.0;
    auto node = r.begin();
    for (const double radius : radii) {
        for (; node != r.end() && *node <= radius; ++node) {
            if (*node <= from) continue;
            sum += between(from, *node);
            from = *node;
        }
        const bool is_beyond = node == r.end() || radius <= from;
        result.push_back(is_beyond ? sum : (sum + between(from, radius)).eval());
    }
    return result;
}

Rgbd RadialProfile::total() const { return r.empty() ? Rgbd::Zero().eval() : cumulative(r.back()); }

Rgbd RadialProfile::mean_radius() const {
    Rgbd zeroth = Rgbd::Zero(), first = Rgbd::Zero();
    for (std::size_t i = 1; i < r.size(); ++i) {
        const double middle = 0.5 * (r[i - 1] + r[i]);
        const Rgbd ring = middle * (r[i] - r[i - 1]) * at(middle);
        zeroth += ring;
        first += ring * middle;
    }
    return first / zeroth.max(1e-300);
}

RadialProfile RadialProfile::scaled(double factor) const {
    RadialProfile result = *this;
    for (double& radius : result.r) radius *= factor;
    for (Rgbd& value : result.rd) value /= factor * factor;
    return result;
}

RadialProfile tabulate(const RgbExponentials& fit, double r_min, double r_max, int count) {
    VITRINE_CHECK_GT(r_max, r_min);
    RadialProfile profile;
    profile.r.push_back(0.0);
    for (int i = 0; i < count; ++i)
        profile.r.push_back(r_min * std::pow(r_max / r_min, static_cast<double>(i) / (count - 1)));
    for (const double radius : profile.r)
        profile.rd.push_back(Rgbd(fit[0](radius), fit[1](radius), fit[2](radius)));
    return profile;
}

double profile_ks_distance(const RadialProfile& a, const RadialProfile& b, int channel,
                           double r_min, double r_max) {
    const Rgbd a0 = a.cumulative(r_min), b0 = b.cumulative(r_min);
    const double a_sum = (a.cumulative(r_max) - a0)[channel];
    const double b_sum = (b.cumulative(r_max) - b0)[channel];
    if (a_sum <= 0 || b_sum <= 0) return 1.0;
    double worst = 0.0;
    const int count = 200;
    for (int i = 1; i < count; ++i) {
        const double radius = r_min * std::pow(r_max / r_min, static_cast<double>(i) / count);
        const double in_a = (a.cumulative(radius) - a0)[channel] / a_sum;
        const double in_b = (b.cumulative(radius) - b0)[channel] / b_sum;
        worst = std::max(worst, std::abs(in_a - in_b));
    }
    return worst;
}

}  // namespace vitrine
