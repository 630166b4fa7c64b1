#include "render/translucent_relief.h"

#include "base/parallel.h"
#include "image/filter.h"
#include "image/poisson.h"
#include "optics/curved_body.h"
#include "render/kernel_table.h"
#include "render/split_kernel.h"

namespace vitrine {
namespace {

struct Sources {
    std::vector<float> x, y, z;
    std::vector<float> normal_x, normal_y, normal_z;
    std::vector<Eigen::Array4f> power;  ///< sum of E dA per cell
};

/// Nearer than this many cells the kernel is capped on the lattice.
constexpr double kCapCells = 1.5;

Eigen::Array4f widen(const Rgb& v) { return {v[0], v[1], v[2], 0.0f}; }

/// Squared distances (in pixels) below this look up the top of the cap.
constexpr float kSmallestSquare = 0.01f;

/// C(s) of optics/curved_body for three channels; all zero: as if flat.
struct BodyFactors {
    Eigen::Array4f linear = Eigen::Array4f::Zero(), quadratic = Eigen::Array4f::Zero();
};

BodyFactors body_factors(const RadialProfile& profile, const TranslucentRenderOptions& options) {
    BodyFactors factors;
    if (!options.use_curved_body) return factors;
    const Rgbd albedo = profile.total();
    for (int c = 0; c < 3; ++c) {
        const CurvedBodyFactor factor = curved_body_factor(albedo[c]);
        factors.linear[c] = static_cast<float>(factor.linear);
        factors.quadratic[c] = static_cast<float>(factor.quadratic);
    }
    return factors;
}

/// sum_i R(|p - y_i|) C(rise) power_i
Eigen::Array4f gather_at(const Vec3f& p, const Vec3f& normal, const Sources& sources,
                         const KernelTable& table, const BodyFactors& body, float q_max) {
    constexpr std::size_t kChunk = 256;
    float q[kChunk], rise[kChunk];
    Eigen::Array4f total = Eigen::Array4f::Zero();
    for (std::size_t begin = 0; begin < sources.x.size(); begin += kChunk) {
        const std::size_t count = std::min(kChunk, sources.x.size() - begin);
        for (std::size_t k = 0; k < count; ++k) {
            const float dx = sources.x[begin + k] - p.x();
            const float dy = sources.y[begin + k] - p.y();
            const float dz = sources.z[begin + k] - p.z();
            q[k] = std::min(dx * dx + dy * dy + dz * dz + kSmallestSquare, q_max);
            const float along = dx * (sources.normal_x[begin + k] - normal.x()) +
                                dy * (sources.normal_y[begin + k] - normal.y()) +
                                dz * (sources.normal_z[begin + k] - normal.z());
            rise[k] = std::min(std::max(0.0f, 0.5f * along / std::sqrt(q[k])), 1.0f);
        }
        for (std::size_t k = 0; k < count; ++k) {
            total += table(q[k]) * sources.power[begin + k] *
                     (1 + rise[k] * (body.linear + rise[k] * body.quadratic));
        }
    }
    return total;
}

float largest_squared_distance(const ReliefSamples& samples) {
    Vec3f low = Vec3f::Constant(1e30f), high = Vec3f::Constant(-1e30f);
    for (const Vec3f& p : samples.position) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    return (high - low).squaredNorm() + 2 * kSmallestSquare;
}

/// Catmull-Rom value of a lattice at real coordinates, borders repeated.
Rgb bicubic(const ImageRgb& lattice, double x, double y) {
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const auto weights = [](double t, float* w) {
        const double t2 = t * t, t3 = t2 * t;
        w[0] = static_cast<float>(0.5 * (-t3 + 2 * t2 - t));
        w[1] = static_cast<float>(0.5 * (3 * t3 - 5 * t2 + 2));
        w[2] = static_cast<float>(0.5 * (-3 * t3 + 4 * t2 + t));
        w[3] = static_cast<float>(0.5 * (t3 - t2));
    };
    float wx[4], wy[4];
    weights(x - x0, wx);
    weights(y - y0, wy);
    Rgb sum = Rgb::Zero();
    for (int j = 0; j < 4; ++j) {
        Rgb line = Rgb::Zero();
        for (int i = 0; i < 4; ++i) line += wx[i] * lattice.clamped(x0 - 1 + i, y0 - 1 + j);
        sum += wy[j] * line;
    }
    return sum;
}

/// Gaussian over the inside of the mask only.
ImageRgb masked_blur(const ImageRgb& image, const Mask& mask, double sigma) {
    if (sigma < 0.3) return image;
    ImageRgb weighted(image.width(), image.height());
    ImageF weight(image.width(), image.height());
    for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] <= 127) continue;
        weighted[i] = image[i];
        weight[i] = 1;
    }
    weighted = gaussian_blur(weighted, sigma);
    weight = gaussian_blur(weight, sigma);
    for (std::size_t i = 0; i < mask.size(); ++i)
        weighted[i] = mask[i] > 127 ? (weighted[i] / std::max(weight[i], 1e-6f)).eval() : image[i];
    return weighted;
}

Sources sources_from(const ReliefSamples& samples, const Relief& relief,
                     const ReliefIrradiance& irradiance) {
    Sources sources;
    for (const Vec3f& p : samples.position) {
        sources.x.push_back(p.x());
        sources.y.push_back(p.y());
        sources.z.push_back(p.z());
    }
    for (const Vec3f& n : samples.normal) {
        sources.normal_x.push_back(n.x());
        sources.normal_y.push_back(n.y());
        sources.normal_z.push_back(n.z());
    }
    sources.power.assign(samples.position.size(), Eigen::Array4f::Zero());
    const double step = samples.step_px;
    for (int y = 0; y < relief.mask.height(); ++y) {
        for (int x = 0; x < relief.mask.width(); ++x) {
            if (!is_inside(relief.mask, x, y)) continue;
            const int cx = static_cast<int>((x - samples.origin_x) / step);
            const int cy = static_cast<int>((y - samples.origin_y) / step);
            const auto k = static_cast<std::size_t>(samples.cell(cx, cy));
            const float area = 1 / std::max(relief.normals(x, y).z(), kMinAreaCos);
            sources.power[k] += widen(irradiance.front(x, y)) * area;
            sources.power[k + samples.front_count] += widen(irradiance.back(x, y)) * area;
        }
    }
    return sources;
}

}  // namespace

TranslucentRelief::TranslucentRelief(Relief relief, const TranslucentRenderOptions& options)
    : relief_(std::move(relief)),
      options_(options),
      samples_(sample_relief(relief_, options.cells_per_side)) {}

std::vector<Rgb> TranslucentRelief::gather(const ReliefIrradiance& irradiance,
                                           const RadialProfile& far,
                                           const RadialProfile& whole) const {
    const Sources sources = sources_from(samples_, relief_, irradiance);
    const float q_max = largest_squared_distance(samples_);
    const KernelTable table(far, kSmallestSquare, q_max);
    const BodyFactors body = body_factors(whole, options_);
    std::vector<Rgb> result(samples_.front_count);
    parallel_for(samples_.front_count, 32, [&](std::size_t k) {
        result[k] = gather_at(samples_.position[k], samples_.normal[k], sources, table, body, q_max)
                        .head<3>();
    });
    return result;
}

ImageRgb TranslucentRelief::render(const ReliefIrradiance& irradiance,
                                   const RadialProfile& profile) const {
    const double step = samples_.step_px;
    const SplitKernel split = split_kernel(profile, kCapCells * step);
    const std::vector<Rgb> exitance = gather(irradiance, split.far, profile);
    ImageRgb lattice(samples_.cell.width(), samples_.cell.height());
    Mask known(lattice.width(), lattice.height());
    for (std::size_t k = 0; k < lattice.size(); ++k) {
        if (samples_.cell[k] < 0) continue;
        lattice[k] = exitance[static_cast<std::size_t>(samples_.cell[k])];
        known[k] = 255;
    }
    lattice = extend_nearest(lattice, known);
    const ImageRgb near = masked_blur(irradiance.front, relief_.mask, split.near_sigma);
    const Rgb near_share = split.near_share.cast<float>();

    ImageRgb result(relief_.mask.width(), relief_.mask.height());
    parallel_for(static_cast<std::size_t>(result.height()), 8, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < result.width(); ++x) {
            if (!is_inside(relief_.mask, x, y)) continue;
            const Rgb b = bicubic(lattice, (x + 0.5 - samples_.origin_x) / step - 0.5,
                                  (y + 0.5 - samples_.origin_y) / step - 0.5) +
                          near_share * near(x, y);
            const double leaving = leaving_transmittance(relief_.normals(x, y), options_.eta);
            result(x, y) = b.max(0.0f) * static_cast<float>(leaving / kPi);
        }
    });
    return result;
}

ImageRgb render_translucent_brute_force(const Relief& relief, const ReliefIrradiance& irradiance,
                                        const RadialProfile& profile,
                                        const TranslucentRenderOptions& options, int stride) {
    const ReliefSamples samples = sample_relief(relief, relief.mask.width() * relief.mask.height());
    const Sources sources = sources_from(samples, relief, irradiance);
    const SplitKernel split = split_kernel(profile, kCapCells);
    const float q_max = largest_squared_distance(samples);
    const KernelTable table(split.far, kSmallestSquare, q_max);
    const Rgb near_share = split.near_share.cast<float>();
    const BodyFactors body = body_factors(profile, options);
    ImageRgb result(relief.mask.width(), relief.mask.height());
    parallel_for(
        static_cast<std::size_t>((result.height() + stride - 1) / stride), 1, [&](std::size_t row) {
            const int y = static_cast<int>(row) * stride;
            for (int x = 0; x < result.width(); x += stride) {
                if (!is_inside(relief.mask, x, y)) continue;
                const Rgb far =
                    gather_at(relief.point(x, y), relief.normals(x, y), sources, table, body, q_max)
                        .head<3>();
                result(x, y) = (far + near_share * irradiance.front(x, y)) *
                               static_cast<float>(
                                   leaving_transmittance(relief.normals(x, y), options.eta) / kPi);
            }
        });
    return result;
}

}  // namespace vitrine
