#include "capture/register_depth.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vitrine {
namespace {

/// Neighbours on one surface differ by less than a surface seen at 80 degrees does from pixel to
/// pixel: by this over the focal length, as a share of the depth (1.5 % for a Kinect).
constexpr double kMaxSlope = 5.7;

struct Projected {
    Vec2 pixel = Vec2::Zero();
    double z = 0.0;  ///< in the colour camera; 0: no reading
    bool is_edge = false;
};

double edge_function(const Vec2& a, const Vec2& b, const Vec2& p) {
    return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
}

/// Pixels of the picture whose centres may lie between `low` and `high`.
struct Span {
    int begin, end;
    Span(double low, double high, int size)
        : begin(static_cast<int>(std::ceil(std::clamp(low, -1.0, double(size))))),
          end(static_cast<int>(std::floor(std::clamp(high, -1.0, double(size)))) + 1) {
        begin = std::max(begin, 0);
        end = std::min(end, size);
    }
};

void keep_nearer(float z, float& out) {
    if (out <= 0 || z < out) out = z;
}

void draw_triangle(const std::array<const Projected*, 3>& t, ImageF& out) {
    const Vec2 &a = t[0]->pixel, &b = t[1]->pixel, &c = t[2]->pixel;
    const double area = edge_function(a, b, c);
    if (std::abs(area) < 1e-9) return;
    const Span columns(std::min({a.x(), b.x(), c.x()}), std::max({a.x(), b.x(), c.x()}),
                       out.width());
    const Span rows(std::min({a.y(), b.y(), c.y()}), std::max({a.y(), b.y(), c.y()}), out.height());
    for (int y = rows.begin; y < rows.end; ++y) {
        for (int x = columns.begin; x < columns.end; ++x) {
            const Vec2 p(x, y);
            const double wa = edge_function(b, c, p) / area, wb = edge_function(c, a, p) / area;
            const double wc = 1 - wa - wb;
            if (wa < 0 || wb < 0 || wc < 0) continue;
            const double inverse = wa / t[0]->z + wb / t[1]->z + wc / t[2]->z;
            keep_nearer(static_cast<float>(1 / inverse), out(x, y));
        }
    }
}

/// A reading beside a step of depth covers its own pixel.
void draw_pixel(const Projected& p, const Vec2& half, double max_step, ImageF& out) {
    const Span columns(p.pixel.x() - half.x(), p.pixel.x() + half.x(), out.width());
    const Span rows(p.pixel.y() - half.y(), p.pixel.y() + half.y(), out.height());
    for (int y = rows.begin; y < rows.end; ++y) {
        for (int x = columns.begin; x < columns.end; ++x) {
            float& there = out(x, y);
            if (there <= 0 || p.z < there * (1 - max_step)) there = static_cast<float>(p.z);
        }
    }
}

std::vector<Projected> project_all(const ImageF& depth_m, const DepthCamera& depth_camera,
                                   const Camera& colour) {
    const Camera& own = depth_camera.intrinsic.camera;
    std::vector<Projected> points(depth_m.size());
    for (int y = 0; y < depth_m.height(); ++y) {
        for (int x = 0; x < depth_m.width(); ++x) {
            const double z = depth_m(x, y);
            if (!(z > 0)) continue;
            const Vec2 bent((x - own.cx) / own.fx, (y - own.cy) / own.fy);
            const Vec2 ideal = depth_camera.intrinsic.distortion.undistort(bent);
            const Vec3 p = depth_camera.colour_from_depth * Vec3(z * ideal.x(), z * ideal.y(), z);
            if (p.z() <= 1e-3) continue;
            points[static_cast<std::size_t>(y) * static_cast<std::size_t>(depth_m.width()) +
                   static_cast<std::size_t>(x)] = {colour.project_camera(p), p.z(), false};
        }
    }
    return points;
}

}  // namespace

ImageF register_depth(const ImageF& depth_m, const DepthCamera& depth_camera,
                      const Camera& colour) {
    std::vector<Projected> points = project_all(depth_m, depth_camera, colour);
    const int width = depth_m.width();
    const auto at = [&](int x, int y) -> Projected& {
        return points[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    };
    const Camera& own = depth_camera.intrinsic.camera;
    const double max_step = kMaxSlope / std::min(own.fx, own.fy);
    ImageF out(colour.width, colour.height, 0.0f);
    const auto draw = [&](Projected& a, Projected& b, Projected& c) {
        const double low = std::min({a.z, b.z, c.z}), high = std::max({a.z, b.z, c.z});
        if (low <= 0 || high - low > max_step * low) {
            a.is_edge = b.is_edge = c.is_edge = true;
            return;
        }
        draw_triangle({&a, &b, &c}, out);
    };
    for (int y = 0; y + 1 < depth_m.height(); ++y) {
        for (int x = 0; x + 1 < width; ++x) {
            draw(at(x, y), at(x + 1, y), at(x + 1, y + 1));
            draw(at(x, y), at(x + 1, y + 1), at(x, y + 1));
        }
    }
    const Vec2 half(0.5 * colour.fx / own.fx, 0.5 * colour.fy / own.fy);
    for (const Projected& p : points) {
        if (p.is_edge && p.z > 0) draw_pixel(p, half, max_step, out);
    }
    return out;
}

}  // namespace vitrine
