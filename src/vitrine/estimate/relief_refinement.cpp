#include "estimate/relief_refinement.h"

#include "image/filter.h"
#include "image/poisson.h"
#include "math/statistics.h"
#include "reconstruct/relief.h"
#include "render/relief_light.h"

namespace vitrine {
namespace {

/// A picture reduced by whole blocks: mean over the inside of the mask.
struct Grid {
    int width = 0, height = 0, block = 1;
    Mask mask;
    ImageF observed;          ///< luminance, blocks without usable pixels take the nearest
    Mask usable;              ///< compared: inside, away from rim and highlights
    ImageF start, height_px;  ///< heights in blocks: of the start, and now
};

Grid make_grid(const Relief& relief, const ImageRgb& diffuse, const Mask& excluded, int block) {
    Grid grid;
    grid.block = block;
    grid.width = (relief.mask.width() + block - 1) / block;
    grid.height = (relief.mask.height() + block - 1) / block;
    grid.mask = Mask(grid.width, grid.height);
    grid.usable = Mask(grid.width, grid.height);
    grid.observed = ImageF(grid.width, grid.height);
    grid.start = ImageF(grid.width, grid.height);
    Mask known(grid.width, grid.height);
    for (int v = 0; v < grid.height; ++v) {
        for (int u = 0; u < grid.width; ++u) {
            double light = 0, z = 0, seen = 0, inside = 0, all = 0;
            for (int y = v * block; y < std::min((v + 1) * block, relief.mask.height()); ++y) {
                for (int x = u * block; x < std::min((u + 1) * block, relief.mask.width()); ++x) {
                    all += 1;
                    if (!is_inside(relief.mask, x, y)) continue;
                    inside += 1;
                    z += relief.depth_px(x, y);
                    if (!excluded.empty() && is_inside(excluded, x, y)) continue;
                    light += luminance(diffuse(x, y));
                    seen += 1;
                }
            }
            if (inside < 0.5 * all) continue;
            grid.mask(u, v) = 255;
            grid.start(u, v) = static_cast<float>(z / inside / block);
            if (seen < 0.5 * all) continue;
            grid.observed(u, v) = static_cast<float>(light / seen);
            known(u, v) = 255;
        }
    }
    grid.observed = extend_nearest(grid.observed, known);
    const Mask inner = erode(grid.mask, 1);
    for (std::size_t i = 0; i < inner.size(); ++i)
        grid.usable[i] = inner[i] > 127 && known[i] > 127 ? 255 : 0;
    grid.height_px = grid.start;
    return grid;
}

ImageF blurred_inside(const ImageF& image, const Mask& mask, double sigma) {
    if (sigma < 0.4) return image;
    ImageF values(image.width(), image.height()), weights(image.width(), image.height());
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127) continue;
        values[i] = image[i];
        weights[i] = 1;
    }
    values = gaussian_blur(values, sigma);
    weights = gaussian_blur(weights, sigma);
    for (std::size_t i = 0; i < mask.size(); ++i)
        values[i] = weights[i] > 1e-6f ? values[i] / weights[i] : image[i];
    return values;
}

/// x -> A x for the quadratic form, with forward differences.
class Quadratic {
  public:
    Quadratic(const Grid& grid, const std::vector<Vec2f>& a, const std::vector<float>& w,
              const ReliefRefinementOptions& options)
        : grid_(grid), a_(a), w_(w), options_(options) {}

    ImageF apply(const ImageF& d) const {
        ImageF result(grid_.width, grid_.height);
        const auto at = [&](int x, int y) { return d.contains(x, y) ? d(x, y) : 0.0f; };
        const auto add = [&](int x, int y, float value) {
            if (result.contains(x, y)) result(x, y) += value;
        };
        for (int y = 0; y < grid_.height; ++y) {
            for (int x = 0; x < grid_.width; ++x) {
                if (!is_inside(grid_.mask, x, y)) continue;
                const auto i = static_cast<std::size_t>(y * grid_.width + x);
                // Slopes by central differences; y up.
                const float gx = 0.5f * (at(x + 1, y) - at(x - 1, y));
                const float gy = 0.5f * (at(x, y - 1) - at(x, y + 1));
                const float data = w_[i] * (a_[i].x() * gx + a_[i].y() * gy);
                const auto stiff = static_cast<float>(options_.stiffness);
                const float fx = 0.5f * (data * a_[i].x() + stiff * gx);
                const float fy = 0.5f * (data * a_[i].y() + stiff * gy);
                add(x + 1, y, fx);
                add(x - 1, y, -fx);
                add(x, y - 1, fy);
                add(x, y + 1, -fy);
                const float bend =
                    4 * at(x, y) - at(x + 1, y) - at(x - 1, y) - at(x, y + 1) - at(x, y - 1);
                const float b = static_cast<float>(options_.bending) * bend / 4;
                add(x, y, 4 * b);
                add(x + 1, y, -b);
                add(x - 1, y, -b);
                add(x, y + 1, -b);
                add(x, y - 1, -b);
            }
        }
        for (std::size_t i = 0; i < result.size(); ++i)
            if (!is_free(i)) result[i] = 0;
        return result;
    }
    /// Gradient of the data term at d = 0, with its sign turned: the right-hand side.
    ImageF right_side(const std::vector<float>& e) const {
        ImageF result(grid_.width, grid_.height);
        const auto add = [&](int x, int y, float value) {
            if (result.contains(x, y)) result(x, y) += value;
        };
        for (int y = 0; y < grid_.height; ++y) {
            for (int x = 0; x < grid_.width; ++x) {
                if (!is_inside(grid_.mask, x, y)) continue;
                const auto i = static_cast<std::size_t>(y * grid_.width + x);
                const float fx = 0.5f * w_[i] * e[i] * a_[i].x();
                const float fy = 0.5f * w_[i] * e[i] * a_[i].y();
                add(x + 1, y, fx);
                add(x - 1, y, -fx);
                add(x, y - 1, fy);
                add(x, y + 1, -fy);
            }
        }
        for (std::size_t i = 0; i < result.size(); ++i)
            if (!is_free(i)) result[i] = 0;
        return result;
    }
    bool is_free(std::size_t i) const {
        const int x = static_cast<int>(i) % grid_.width, y = static_cast<int>(i) / grid_.width;
        return is_inside(grid_.mask, x, y) && is_inside(grid_.mask, x + 1, y) &&
               is_inside(grid_.mask, x - 1, y) && is_inside(grid_.mask, x, y + 1) &&
               is_inside(grid_.mask, x, y - 1);
    }

  private:
    const Grid& grid_;
    const std::vector<Vec2f>& a_;
    const std::vector<float>& w_;
    const ReliefRefinementOptions& options_;
};

double dot(const ImageF& a, const ImageF& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(a[i]) * b[i];
    return sum;
}

ImageF conjugate_gradients(const Quadratic& form, const ImageF& right, int iterations) {
    ImageF x(right.width(), right.height());
    ImageF r = right, p = right;
    double rr = dot(r, r);
    const double goal = 1e-6 * rr;
    for (int k = 0; k < iterations && rr > goal && rr > 0; ++k) {
        const ImageF ap = form.apply(p);
        const double curvature = dot(p, ap);
        if (curvature <= 0) break;
        const auto step = static_cast<float>(rr / curvature);
        for (std::size_t i = 0; i < x.size(); ++i) {
            x[i] += step * p[i];
            r[i] -= step * ap[i];
        }
        const double next = dot(r, r);
        const auto keep = static_cast<float>(next / rr);
        for (std::size_t i = 0; i < p.size(); ++i) p[i] = r[i] + keep * p[i];
        rr = next;
    }
    return x;
}

/// One Gauss-Newton step on grid.height_px.
void improve(Grid& grid, const ViewLights& lights, double blur, double eta,
             const ReliefRefinementOptions& options) {
    const Image<Vec3f> normals = relief_normals(grid.height_px, grid.mask, 0.7);
    const std::size_t count = grid.mask.size();
    ImageF predicted(grid.width, grid.height);
    std::vector<Vec2f> a(count, Vec2f::Zero());
    for (std::size_t i = 0; i < count; ++i) {
        if (grid.mask[i] <= 127) continue;
        const Vec3f n = normals[i];
        const float nz = std::max(n.z(), 0.15f);
        const float zx = -n.x() / nz, zy = -n.y() / nz;
        const float length = std::sqrt(1 + zx * zx + zy * zy);
        double e = luminance(lights.ambient) + luminance(lights.from_below) * facing_down(n);
        for (const ViewLight& light : lights.lights) {
            const Vec3f w = light.direction.cast<float>();
            const double strength = luminance(light.intensity);
            const double cosine = n.dot(w);
            e += strength * entering_irradiance(n, light.direction, eta);
            if (cosine <= 0) continue;
            // d(n . w) / d(zx, zy) with n = (-zx, -zy, 1) / length.
            const auto c = static_cast<float>(cosine);
            const float scale = static_cast<float>(strength);
            a[i].x() += scale * (-w.x() / length - c * zx / (length * length));
            a[i].y() += scale * (-w.y() / length - c * zy / (length * length));
        }
        predicted[i] = static_cast<float>(e);
    }
    // Scattering takes contrast from the slopes as it does from the light.
    predicted = blurred_inside(predicted, grid.mask, blur);
    std::vector<double> ratios;
    for (std::size_t i = 0; i < count; ++i)
        if (grid.usable[i] > 127 && predicted[i] > 0)
            ratios.push_back(grid.observed[i] / predicted[i]);
    if (ratios.size() < 20) return;
    const auto level = static_cast<float>(std::max(median(ratios), 1e-9));
    std::vector<float> e(count, 0.0f), w(count, 0.0f);
    std::vector<double> sizes;
    for (std::size_t i = 0; i < count; ++i) {
        if (grid.usable[i] <= 127) continue;
        e[i] = grid.observed[i] / level - predicted[i];
        sizes.push_back(std::abs(e[i]));
    }
    const auto bend = static_cast<float>(std::max(2.0 * median(sizes), 1e-6));
    double slope_sum = 0, slope_count = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (grid.usable[i] <= 127) continue;
        w[i] = std::min(1.0f, bend / std::max(std::abs(e[i]), 1e-9f));
        slope_sum += a[i].squaredNorm();
        slope_count += 1;
    }
    // In units of the mean derivative: stiffness is then a pure number.
    const auto unit = static_cast<float>(slope_count / std::max(slope_sum, 1e-12));
    for (float& weight : w) weight *= unit;
    const Quadratic form(grid, a, w, options);
    // The stiffness acts on the whole correction, so it pulls back what earlier rounds did.
    ImageF so_far(grid.width, grid.height);
    for (std::size_t i = 0; i < count; ++i) so_far[i] = grid.height_px[i] - grid.start[i];
    const std::vector<float> none(count, 0.0f);
    const Quadratic pull(grid, a, none, options);
    ImageF right = form.right_side(e);
    const ImageF back = pull.apply(so_far);
    for (std::size_t i = 0; i < count; ++i) right[i] -= form.is_free(i) ? back[i] : 0.0f;
    const ImageF d = conjugate_gradients(form, right, 150);
    for (std::size_t i = 0; i < count; ++i) {
        if (grid.mask[i] <= 127) continue;
        grid.height_px[i] = std::max(grid.height_px[i] + d[i], 0.15f * grid.start[i]);
    }
}

/// Bilinear value of the grid at a pixel.
float at_pixel(const ImageF& field, int x, int y, int block) {
    const double u = (x + 0.5) / block - 0.5, v = (y + 0.5) / block - 0.5;
    const int x0 = static_cast<int>(std::floor(u)), y0 = static_cast<int>(std::floor(v));
    const auto s = static_cast<float>(u - x0), t = static_cast<float>(v - y0);
    return (1 - t) * ((1 - s) * field.clamped(x0, y0) + s * field.clamped(x0 + 1, y0)) +
           t * ((1 - s) * field.clamped(x0, y0 + 1) + s * field.clamped(x0 + 1, y0 + 1));
}

}  // namespace

Relief refine_relief(const Relief& start, const ImageRgb& diffuse, const Mask& excluded,
                     const ViewLights& lights, double kernel_px, double eta,
                     const ReliefRefinementOptions& options) {
    if (start.is_cluster() || lights.lights.empty()) return start;
    const int block =
        std::max(1, static_cast<int>(std::lround(start.inradius_px / options.work_radius)));
    Grid grid = make_grid(start, diffuse, excluded, block);
    const double blur = std::min(0.5 * kernel_px / block, 0.25 * options.work_radius);
    for (int round = 0; round < options.rounds; ++round) improve(grid, lights, blur, eta, options);

    Relief result = start;
    ImageF ratio(grid.width, grid.height);
    Mask known(grid.width, grid.height);
    for (std::size_t i = 0; i < ratio.size(); ++i) {
        if (grid.mask[i] <= 127 || grid.start[i] <= 0) continue;
        ratio[i] = grid.height_px[i] - grid.start[i];
        known[i] = 255;
    }
    ratio = extend_nearest(ratio, known);
    for (int y = 0; y < result.mask.height(); ++y) {
        for (int x = 0; x < result.mask.width(); ++x) {
            if (!is_inside(result.mask, x, y)) continue;
            float& z = result.depth_px(x, y);
            z = std::max(z + static_cast<float>(block) * at_pixel(ratio, x, y, block), 0.1f * z);
        }
    }
    result.normals = relief_normals(result.depth_px, result.mask, std::max(1.0, 0.5 * block));
    result.base_normals = {};
    return result;
}

}  // namespace vitrine
