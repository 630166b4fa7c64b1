#include "reconstruct/revolution.h"

#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace vitrine {
namespace {

constexpr double kSoftness_m = 0.0004;  // views within this of the largest share the say
constexpr double kConeRun_m = 0.006;    // the slope of a cone is measured over this; narrower: none
constexpr double kMaxConeSlope = 1.2;   // steeper flanks are seen by some camera
constexpr double kRimSlopeStep = 1.0;   // beyond the cone the profile falls off: a rim
constexpr double kCapFit_m = 0.012;     // of the outline beyond the cone, to fit its ball
constexpr double kSearchStep_m = 0.004;

/// Mean of the values, those below the largest fading out: the largest alone would add up the noise
/// of all outlines.
double soft_largest(const std::vector<double>& values) {
    const double largest = *std::max_element(values.begin(), values.end());
    double sum = 0, weight = 0;
    for (const double v : values) {
        const double w = std::exp((v - largest) / kSoftness_m);
        sum += w * v;
        weight += w;
    }
    return sum / weight;
}

double carved_volume(const ProfileField& profile) {
    const double soft = 0.5 * profile.spacing_m;
    double sum = 0;
    for (int h = 0; h < profile.heights; ++h) {
        for (int r = 0; r < profile.radii; ++r) {
            sum += r * std::clamp(0.5 - profile.at(r, h) / (2 * soft), 0.0, 1.0);
        }
    }
    return sum;
}

/// Height of the profile's upper (or lower) side over each radius, where there is one.
std::vector<std::optional<double>> side(const ProfileField& p, bool is_upper) {
    std::vector<std::optional<double>> heights(static_cast<std::size_t>(p.radii));
    for (int r = 0; r < p.radii; ++r) {
        for (int k = 0; k + 1 < p.heights; ++k) {
            const int outer = is_upper ? p.heights - 1 - k : k;
            const int inner = is_upper ? outer - 1 : outer + 1;
            const double a = p.at(r, outer), b = p.at(r, inner);
            if (a >= 0 && b < 0) {
                const double t = a / (a - b);
                heights[static_cast<std::size_t>(r)] =
                    p.base_m + p.spacing_m * (outer + t * (inner - outer));
                break;
            }
            if (b < 0 && a < 0) break;  // reaches the border (the underside below the plane)
        }
    }
    return heights;
}

/// The piece of the profile beside the axis that no camera saw tangentially.
struct Cone {
    std::size_t end;  ///< column where it leaves the slope it starts with
    bool ends_at_rim;
};

using Side = std::vector<std::optional<double>>;

/// Fall of the side per radius around column i, over about +-2 mm; none at its ends.
std::optional<double> slope_at(const Side& side, double spacing_m, double sign, std::size_t i) {
    const auto reach = std::max<std::size_t>(1, std::size_t(std::lround(0.002 / spacing_m)));
    if (i < reach || i + reach >= side.size() || !side[i - reach] || !side[i + reach]) return {};
    return sign * (*side[i - reach] - *side[i + reach]) / (2 * double(reach) * spacing_m);
}

std::optional<Cone> find_cone(const Side& heights, double spacing_m, double sign) {
    std::size_t first = 0;
    while (first < heights.size() && !heights[first]) ++first;
    const auto run = static_cast<std::size_t>(std::lround(kConeRun_m / spacing_m));
    if (first + run >= heights.size() || !heights[first + run]) return {};
    const double slope = sign * (*heights[first] - *heights[first + run]) / kConeRun_m;
    if (slope < 0.05 || slope > kMaxConeSlope) return {};
    std::size_t end = first + run / 2;
    std::optional<double> here;
    for (; end < heights.size(); ++end) {
        here = slope_at(heights, spacing_m, sign, end);
        if (!here || *here > 1.2 * slope + 0.06) break;
    }
    const auto beyond = end + static_cast<std::size_t>(std::lround(0.003 / spacing_m));
    const std::optional<double> next = slope_at(heights, spacing_m, sign, beyond);
    return Cone{end, !here || !next || *next - slope > kRimSlopeStep};
}

/// Ball with its centre on the axis through the outline beyond the cone: least squares of
/// rho^2 + h^2 = 2 h centre + (radius^2 - centre^2).
bool fit_cap(const Side& heights, double spacing_m, std::size_t begin, double& centre,
             double& radius) {
    const auto count = static_cast<std::size_t>(std::lround(kCapFit_m / spacing_m));
    double n = 0, sh = 0, shh = 0, sy = 0, shy = 0;
    for (std::size_t i = begin; i < std::min(begin + count, heights.size()); ++i) {
        if (!heights[i]) break;
        const double h = *heights[i], rho = double(i) * spacing_m, y = rho * rho + h * h;
        n += 1, sh += h, shh += h * h, sy += y, shy += h * y;
    }
    const double determinant = n * shh - sh * sh;
    if (n < 4 || determinant <= 0) return false;
    const double slope = (n * shy - sh * sy) / determinant;
    centre = 0.5 * slope;
    const double square = (sy - slope * sh) / n + centre * centre;
    radius = std::sqrt(std::max(square, 0.0));
    return square > 0;
}

void complete_pole(ProfileField& p, bool is_upper) {
    const double sign = is_upper ? 1.0 : -1.0;
    const Side heights = side(p, is_upper);
    const std::optional<Cone> cone = find_cone(heights, p.spacing_m, sign);
    if (!cone || cone->end >= heights.size() || !heights[cone->end]) return;
    if (!is_upper && cone->ends_at_rim) return;
    double centre = 0, radius = 0;
    if (!cone->ends_at_rim && !fit_cap(heights, p.spacing_m, cone->end, centre, radius)) return;
    const double end_height = *heights[cone->end];
    const int columns = static_cast<int>(cone->end);
    for (int h = 0; h < p.heights; ++h) {
        const double height = p.base_m + h * p.spacing_m;
        for (int r = 0; r < (cone->ends_at_rim ? p.radii : columns); ++r) {
            const double rho = r * p.spacing_m;
            double cut = sign * (height - end_height);
            if (!cone->ends_at_rim) {
                if (sign * (height - centre) <= 0) continue;
                cut = std::hypot(rho, height - centre) - radius;
            }
            p.at(r, h) = std::max(p.at(r, h), static_cast<float>(cut));
        }
    }
}

}  // namespace

float ProfileField::sample(double radius_m, double height_m) const {
    const double x = std::clamp(radius_m / spacing_m, 0.0, radii - 1.001);
    const double y = std::clamp((height_m - base_m) / spacing_m, 0.0, heights - 1.001);
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const double tx = x - x0, ty = y - y0;
    return static_cast<float>((1 - ty) * ((1 - tx) * at(x0, y0) + tx * at(x0 + 1, y0)) +
                              ty * ((1 - tx) * at(x0, y0 + 1) + tx * at(x0 + 1, y0 + 1)));
}

ProfileField carve_profile(std::span<const OutlineView> views, const Plane& support,
                           const Vec3& foot, double max_radius_m, double max_height_m,
                           double spacing_m, int angles) {
    ProfileField profile;
    profile.spacing_m = spacing_m;
    profile.base_m = -3 * spacing_m;
    profile.radii = static_cast<int>(max_radius_m / spacing_m) + 2;
    profile.heights = static_cast<int>(max_height_m / spacing_m) + 5;
    profile.values.assign(static_cast<std::size_t>(profile.radii * profile.heights), 0.0f);
    const Mat3 axes = vitrine::plane_from_world(support).rotation.transpose();
    parallel_for(profile.values.size(), 64, [&](std::size_t i) {
        const int r = static_cast<int>(i) % profile.radii, h = static_cast<int>(i) / profile.radii;
        const double rho = r * spacing_m, height = profile.base_m + h * spacing_m;
        std::vector<double> worst;
        for (const OutlineView& view : views) {
            double largest = -1e9, distance = 0;
            for (int a = 0; a < (r == 0 ? 1 : angles); ++a) {
                const double phi = 2 * kPi * a / angles;
                const Vec3 p = foot + axes * Vec3(rho * std::cos(phi), rho * std::sin(phi), height);
                if (outline_distance(view, p, distance)) largest = std::max(largest, distance);
            }
            if (largest > -1e8) worst.push_back(largest);
        }
        profile.values[i] =
            worst.empty() ? static_cast<float>(max_radius_m) : float(soft_largest(worst));
    });
    return profile;
}

Vec3 find_axis_foot(std::span<const OutlineView> views, const Plane& support, const Vec3& start,
                    double max_radius_m, double max_height_m) {
    const Mat3 axes = vitrine::plane_from_world(support).rotation.transpose();
    const auto score = [&](const Vec3& foot) {
        return carved_volume(
            carve_profile(views, support, foot, max_radius_m, max_height_m, 0.003, 40));
    };
    Vec3 best = support.project(start);
    double best_score = score(best);
    for (double step = kSearchStep_m; step > 0.00015; step *= 0.5) {
        for (int round = 0; round < 3; ++round) {
            const Vec3 centre = best;
            for (int d = 0; d < 4; ++d) {
                const Vec3 trial = centre + axes * (step * Vec3(d == 0   ? 1
                                                                : d == 1 ? -1
                                                                         : 0,
                                                                d == 2   ? 1
                                                                : d == 3 ? -1
                                                                         : 0,
                                                                0));
                const double value = score(trial);
                if (value > best_score) best_score = value, best = trial;
            }
            if (best == centre) break;
        }
    }
    return best;
}

void complete_poles(ProfileField& profile) {
    complete_pole(profile, true);
    complete_pole(profile, false);
}

ScalarGrid revolve(const ProfileField& profile, const Plane& support, const Vec3& foot,
                   const ScalarGrid& like) {
    ScalarGrid grid = like;
    parallel_for(grid.values.size(), 4096, [&](std::size_t i) {
        const Eigen::Vector3i c = grid.node_of(i);
        const Vec3 d = grid.node(c.x(), c.y(), c.z()) - foot;
        const double height = support.normal.dot(d);
        grid.values[i] = profile.sample((d - height * support.normal).norm(), height);
    });
    return grid;
}

}  // namespace vitrine
