#include "image/poisson.h"

#include "base/parallel.h"
#include "image/pixel_box.h"

#include <array>
#include <limits>

namespace vitrine {
namespace {

constexpr std::size_t kGrain = 4096;

/// The equations of one level in compact form: unknowns are numbered, others are folded into `b`.
struct System {
    std::vector<std::int32_t> pixel;                     ///< pixel of each unknown
    std::vector<std::array<std::int32_t, 4>> neighbour;  ///< unknown numbers, -1 = none
    std::vector<float> diagonal;
    std::vector<float> b;
};

System assemble(const Mask& unknown, const ImageF& known, const ImageF& source,
                PoissonBorder border) {
    System system;
    Image<std::int32_t> number(unknown.width(), unknown.height(), -1);
    for (std::size_t i = 0; i < unknown.size(); ++i) {
        if (unknown[i] <= 127) continue;
        number[i] = static_cast<std::int32_t>(system.pixel.size());
        system.pixel.push_back(static_cast<std::int32_t>(i));
    }
    system.neighbour.resize(system.pixel.size());
    system.diagonal.resize(system.pixel.size());
    system.b.resize(system.pixel.size());
    const int dx[4] = {1, -1, 0, 0}, dy[4] = {0, 0, 1, -1};
    parallel_for(system.pixel.size(), kGrain, [&](std::size_t k) {
        const int x = system.pixel[k] % unknown.width(), y = system.pixel[k] / unknown.width();
        float diagonal = 0, b = source(x, y);
        for (std::size_t n = 0; n < 4; ++n) {
            const int nx = x + dx[n], ny = y + dy[n];
            system.neighbour[k][n] = -1;
            if (!unknown.contains(nx, ny)) {
                if (border == PoissonBorder::Zero) diagonal += 1;
                continue;
            }
            diagonal += 1;
            system.neighbour[k][n] = number(nx, ny);
            if (number(nx, ny) < 0) b += known(nx, ny);
        }
        system.diagonal[k] = std::max(diagonal, 1e-6f);
        system.b[k] = b;
    });
    return system;
}

double dot(const std::vector<float>& a, const std::vector<float>& b) {
    return parallel_sum(a.size(), kGrain, 0.0, [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) sum += static_cast<double>(a[i]) * b[i];
        return sum;
    });
}

void multiply(const System& system, const std::vector<float>& x, std::vector<float>& y) {
    parallel_for(x.size(), kGrain, [&](std::size_t k) {
        float sum = system.diagonal[k] * x[k];
        for (const std::int32_t n : system.neighbour[k])
            if (n >= 0) sum -= x[static_cast<std::size_t>(n)];
        y[k] = sum;
    });
}

/// Conjugate gradients with the diagonal as preconditioner, from the start in `x`.
void conjugate_gradients(const System& system, std::vector<float>& x,
                         const PoissonOptions& options) {
    const std::size_t count = x.size();
    std::vector<float> r(count), z(count), p(count), q(count);
    multiply(system, x, q);
    for (std::size_t i = 0; i < count; ++i) r[i] = system.b[i] - q[i];
    const double goal = options.tolerance * options.tolerance * dot(system.b, system.b);
    double rho_last = 0;
    for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
        if (dot(r, r) <= goal) break;
        for (std::size_t i = 0; i < count; ++i) z[i] = r[i] / system.diagonal[i];
        const double rho = dot(r, z);
        const float beta = iteration == 0 ? 0.0f : static_cast<float>(rho / rho_last);
        for (std::size_t i = 0; i < count; ++i) p[i] = z[i] + beta * p[i];
        multiply(system, p, q);
        const double curvature = dot(p, q);
        if (curvature <= 0) break;
        const auto alpha = static_cast<float>(rho / curvature);
        for (std::size_t i = 0; i < count; ++i) {
            x[i] += alpha * p[i];
            r[i] -= alpha * q[i];
        }
        rho_last = rho;
    }
}

/// The same problem with cells of 2 x 2 pixels. A cell is unknown when any of its pixels is; the
/// source grows fourfold with the area.
void coarsen(const Mask& unknown, const ImageF& known, const ImageF& source, Mask& coarse_unknown,
             ImageF& coarse_known, ImageF& coarse_source) {
    const int width = (unknown.width() + 1) / 2, height = (unknown.height() + 1) / 2;
    coarse_unknown = Mask(width, height);
    coarse_known = ImageF(width, height);
    coarse_source = ImageF(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            float known_sum = 0, known_count = 0, source_sum = 0, unknown_count = 0;
            for (int j = 0; j < 2; ++j) {
                for (int i = 0; i < 2; ++i) {
                    const int fx = 2 * x + i, fy = 2 * y + j;
                    if (!unknown.contains(fx, fy)) continue;
                    if (unknown(fx, fy) > 127) {
                        source_sum += source(fx, fy);
                        unknown_count += 1;
                    } else {
                        known_sum += known(fx, fy);
                        known_count += 1;
                    }
                }
            }
            coarse_unknown(x, y) = unknown_count > 0 ? 255 : 0;
            if (known_count > 0) coarse_known(x, y) = known_sum / known_count;
            if (unknown_count > 0) coarse_source(x, y) = 4 * source_sum / unknown_count;
        }
    }
}

ImageF solve_level(const Mask& unknown, const ImageF& known, const ImageF& source,
                   const PoissonOptions& options) {
    ImageF u = known;
    const System system = assemble(unknown, known, source, options.border);
    if (system.pixel.empty()) return u;
    std::vector<float> x(system.pixel.size(), 0.0f);
    if (system.pixel.size() > 400 && std::min(unknown.width(), unknown.height()) > 8) {
        Mask coarse_unknown;
        ImageF coarse_known, coarse_source;
        coarsen(unknown, known, source, coarse_unknown, coarse_known, coarse_source);
        const ImageF coarse = solve_level(coarse_unknown, coarse_known, coarse_source, options);
        for (std::size_t k = 0; k < x.size(); ++k) {
            const int px = system.pixel[k] % unknown.width();
            const int py = system.pixel[k] / unknown.width();
            x[k] = bilinear(coarse, 0.5 * px - 0.25, 0.5 * py - 0.25);
        }
    }
    conjugate_gradients(system, x, options);
    for (std::size_t k = 0; k < x.size(); ++k) u[static_cast<std::size_t>(system.pixel[k])] = x[k];
    return u;
}

/// Index of the nearest inside pixel of every pixel: two passes of the exact distance transform
/// (columns by sweeping, rows by lower envelopes; Felzenszwalb and Huttenlocher 2012).
Image<std::int32_t> nearest_inside(const Mask& mask) {
    const int width = mask.width(), height = mask.height();
    Image<std::int32_t> row_of(width, height, -1);  // nearest inside row of the same column
    for (int x = 0; x < width; ++x) {
        int last = -1;
        for (int y = 0; y < height; ++y) {
            if (mask(x, y) > 127) last = y;
            row_of(x, y) = last;
        }
        last = -1;
        for (int y = height - 1; y >= 0; --y) {
            if (mask(x, y) > 127) last = y;
            const int up = row_of(x, y);
            if (last >= 0 && (up < 0 || last - y < y - up)) row_of(x, y) = last;
        }
    }
    Image<std::int32_t> nearest(width, height, -1);
    parallel_for(static_cast<std::size_t>(height), 8, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        std::vector<int> site;
        std::vector<double> from;
        for (int x = 0; x < width; ++x) {
            if (row_of(x, y) < 0) continue;
            const double fx = std::pow(row_of(x, y) - y, 2) + static_cast<double>(x) * x;
            double start = -std::numeric_limits<double>::infinity();
            while (!site.empty()) {
                const int s = site.back();
                const double fs = std::pow(row_of(s, y) - y, 2) + static_cast<double>(s) * s;
                start = (fx - fs) / (2.0 * (x - s));
                if (start > from.back()) break;
                site.pop_back();
                from.pop_back();
                start = -std::numeric_limits<double>::infinity();
            }
            site.push_back(x);
            from.push_back(start);
        }
        std::size_t k = 0;
        for (int x = 0; x < width && !site.empty(); ++x) {
            while (k + 1 < site.size() && from[k + 1] <= x) ++k;
            nearest(x, y) = row_of(site[k], y) * width + site[k];
        }
    });
    return nearest;
}

template <typename T>
Image<T> extend(const Image<T>& image, const Mask& mask) {
    VITRINE_CHECK(mask.same_size(image));
    const Image<std::int32_t> nearest = nearest_inside(mask);
    Image<T> result = image;
    for (std::size_t i = 0; i < image.size(); ++i)
        if (nearest[i] >= 0) result[i] = image[static_cast<std::size_t>(nearest[i])];
    return result;
}

}  // namespace

ImageF solve_poisson(const Mask& unknown, const ImageF& known, const ImageF& source,
                     const PoissonOptions& options) {
    VITRINE_CHECK(unknown.same_size(known) && unknown.same_size(source));
    const PixelBox box = PixelBox::of(unknown).grown(1, unknown.width(), unknown.height());
    if (box.is_empty()) return known;
    const ImageF part =
        solve_level(crop(unknown, box), crop(known, box), crop(source, box), options);
    ImageF u = known;
    for (int y = 0; y < box.height(); ++y)
        for (int x = 0; x < box.width(); ++x) u(box.x0 + x, box.y0 + y) = part(x, y);
    return u;
}

ImageRgb harmonic_fill(const ImageRgb& image, const Mask& hole) {
    ImageRgb result = image;
    const ImageF zero(image.width(), image.height());
    for (int c = 0; c < 3; ++c) {
        ImageF channel(image.width(), image.height());
        for (std::size_t i = 0; i < image.size(); ++i) channel[i] = image[i][c];
        const ImageF filled = solve_poisson(hole, channel, zero);
        for (std::size_t i = 0; i < image.size(); ++i) result[i][c] = filled[i];
    }
    return result;
}

ImageF inflate(const Mask& mask) {
    PoissonOptions options;
    options.border = PoissonBorder::Zero;
    options.tolerance = 1e-6;
    return solve_poisson(mask, ImageF(mask.width(), mask.height()),
                         ImageF(mask.width(), mask.height(), 1.0f), options);
}

ImageRgb extend_nearest(const ImageRgb& image, const Mask& mask) { return extend(image, mask); }
ImageF extend_nearest(const ImageF& image, const Mask& mask) { return extend(image, mask); }

}  // namespace vitrine
