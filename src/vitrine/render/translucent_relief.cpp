#include "render/translucent_relief.h"

#include "base/parallel.h"
#include "image/filter.h"
#include "image/pixel_box.h"
#include "image/poisson.h"
#include "optics/curved_body.h"
#include "render/kernel_table.h"
#include "render/split_kernel.h"

namespace vitrine {
namespace {

/// Points that send light: samples, or blocks of them.
struct Emitters {
    std::vector<float> x, y, z;
    std::vector<float> normal_x, normal_y, normal_z;
    std::vector<Eigen::Array4f> power;  ///< sum of E dA

    std::size_t size() const { return x.size(); }
    void add(const Vec3f& position, const Vec3f& normal, const Eigen::Array4f& sum) {
        x.push_back(position.x());
        y.push_back(position.y());
        z.push_back(position.z());
        normal_x.push_back(normal.x());
        normal_y.push_back(normal.y());
        normal_z.push_back(normal.z());
        power.push_back(sum);
    }
};

/// The samples in the order of their blocks, and the blocks, which stand for their samples from
/// afar (Jensen and Buhler 2002, with one level).
struct Sources {
    Emitters samples, blocks;
    std::vector<std::size_t> begin;  ///< of each block's samples; one more at the end
    std::vector<float> far_squared;  ///< from where on a block stands for its samples
};

/// Cells along a block, and from how many of its radii on it will do.
constexpr int kBlockCells = 4;
constexpr float kFarRadii = 6;

/// Nearer than this many cells the kernel is capped on the lattice.
constexpr double kCapCells = 1.5;

Eigen::Array4f widen(const Rgb& v) { return {v[0], v[1], v[2], 0.0f}; }

/// Squared distances (in pixels) below this look up the top of the cap.
constexpr float kSmallestSquare = 0.01f;

/// C(s) of optics/curved_body for three channels; all zero: as if flat.
struct BodyFactors {
    Eigen::Array4f linear = Eigen::Array4f::Zero(), quadratic = Eigen::Array4f::Zero();
    Eigen::Array4f operator()(float rise) const { return 1 + rise * (linear + rise * quadratic); }
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

/// What a receiver needs to know of emitters [begin, begin + count): squared distance, chord rise.
void distances(const Vec3f& p, const Vec3f& normal, const Emitters& from, std::size_t begin,
               std::size_t count, float q_max, float* q, float* rise) {
    for (std::size_t k = 0; k < count; ++k) {
        const float dx = from.x[begin + k] - p.x();
        const float dy = from.y[begin + k] - p.y();
        const float dz = from.z[begin + k] - p.z();
        q[k] = std::min(dx * dx + dy * dy + dz * dz + kSmallestSquare, q_max);
        const float along = dx * (from.normal_x[begin + k] - normal.x()) +
                            dy * (from.normal_y[begin + k] - normal.y()) +
                            dz * (from.normal_z[begin + k] - normal.z());
        rise[k] = std::min(std::max(0.0f, 0.5f * along / std::sqrt(q[k])), 1.0f);
    }
}

/// sum_i R(|p - y_i|) C(rise) power_i over all samples, one by one.
Eigen::Array4f gather_all(const Vec3f& p, const Vec3f& normal, const Emitters& samples,
                          const KernelTable& table, const BodyFactors& body, float q_max) {
    constexpr std::size_t kChunk = 256;
    float q[kChunk], rise[kChunk];
    Eigen::Array4f total = Eigen::Array4f::Zero();
    for (std::size_t begin = 0; begin < samples.size(); begin += kChunk) {
        const std::size_t count = std::min(kChunk, samples.size() - begin);
        distances(p, normal, samples, begin, count, q_max, q, rise);
        for (std::size_t k = 0; k < count; ++k)
            total += table(q[k]) * samples.power[begin + k] * body(rise[k]);
    }
    return total;
}

/// The same, far blocks as one.
Eigen::Array4f gather_at(const Vec3f& p, const Vec3f& normal, const Sources& sources,
                         const KernelTable& table, const BodyFactors& body, float q_max) {
    constexpr std::size_t kChunk = 128;
    constexpr std::size_t kBlock = kBlockCells * kBlockCells;
    float block_q[kChunk], block_rise[kChunk], q[kBlock], rise[kBlock];
    Eigen::Array4f total = Eigen::Array4f::Zero();
    for (std::size_t first = 0; first < sources.blocks.size(); first += kChunk) {
        const std::size_t blocks = std::min(kChunk, sources.blocks.size() - first);
        distances(p, normal, sources.blocks, first, blocks, q_max, block_q, block_rise);
        for (std::size_t j = 0; j < blocks; ++j) {
            const std::size_t block = first + j;
            if (block_q[j] > sources.far_squared[block]) {
                total += table(block_q[j]) * sources.blocks.power[block] * body(block_rise[j]);
                continue;
            }
            const std::size_t begin = sources.begin[block];
            const std::size_t count = sources.begin[block + 1] - begin;
            distances(p, normal, sources.samples, begin, count, q_max, q, rise);
            for (std::size_t k = 0; k < count; ++k)
                total += table(q[k]) * sources.samples.power[begin + k] * body(rise[k]);
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

/// Gaussian over the inside of the mask only; 0 outside.
ImageRgb masked_blur(const ImageRgb& image, const Mask& mask, double sigma) {
    if (sigma < 0.3) return image;
    // The object is often a small part of the picture. A rim of zeros, which the blur repeats:
    // nothing comes in from outside the mask.
    ImageRgb result(mask.width(), mask.height());
    const PixelBox box = PixelBox::of(mask);
    ImageRgb weighted(box.width() + 2, box.height() + 2);
    ImageF weight(box.width() + 2, box.height() + 2);
    for (int y = 0; y < box.height(); ++y) {
        for (int x = 0; x < box.width(); ++x) {
            if (!is_inside(mask, box.x0 + x, box.y0 + y)) continue;
            weighted(x + 1, y + 1) = image(box.x0 + x, box.y0 + y);
            weight(x + 1, y + 1) = 1;
        }
    }
    weighted = gaussian_blur(weighted, sigma);
    weight = gaussian_blur(weight, sigma);
    for (int y = 0; y < box.height(); ++y)
        for (int x = 0; x < box.width(); ++x)
            if (is_inside(mask, box.x0 + x, box.y0 + y))
                result(box.x0 + x, box.y0 + y) =
                    weighted(x + 1, y + 1) / std::max(weight(x + 1, y + 1), 1e-6f);
    return result;
}

/// Light that enters at each sample.
std::vector<Eigen::Array4f> sample_powers(const ReliefSamples& samples, const Relief& relief,
                                          const ReliefIrradiance& irradiance) {
    std::vector<Eigen::Array4f> power(samples.position.size(), Eigen::Array4f::Zero());
    const double step = samples.step_px;
    for (int y = 0; y < relief.mask.height(); ++y) {
        for (int x = 0; x < relief.mask.width(); ++x) {
            if (!is_inside(relief.mask, x, y)) continue;
            const int cx = static_cast<int>((x - samples.origin_x) / step);
            const int cy = static_cast<int>((y - samples.origin_y) / step);
            const auto k = static_cast<std::size_t>(samples.cell(cx, cy));
            const float area = 1 / std::max(relief.normals(x, y).z(), kMinAreaCos);
            power[k] += widen(irradiance.front(x, y)) * area;
            power[k + samples.front_count] += widen(irradiance.back(x, y)) * area;
        }
    }
    return power;
}

Emitters all_samples(const ReliefSamples& samples, const std::vector<Eigen::Array4f>& power) {
    Emitters all;
    for (std::size_t k = 0; k < power.size(); ++k)
        all.add(samples.position[k], samples.normal[k], power[k]);
    return all;
}

/// Closes the block whose samples are the last ones of `sources.samples`.
void add_block(Sources& sources) {
    const Emitters& all = sources.samples;
    const std::size_t begin = sources.begin.back();
    if (all.size() == begin) return;
    Vec3f centre = Vec3f::Zero(), normal = Vec3f::Zero();
    Eigen::Array4f power = Eigen::Array4f::Zero();
    float weights = 0;
    const auto at = [&](std::size_t k) { return Vec3f(all.x[k], all.y[k], all.z[k]); };
    for (std::size_t k = begin; k < all.size(); ++k) {
        const float weight = all.power[k].sum() + 1e-20f;
        centre += weight * at(k);
        normal += weight * Vec3f(all.normal_x[k], all.normal_y[k], all.normal_z[k]);
        power += all.power[k];
        weights += weight;
    }
    centre /= weights;
    float radius_squared = 0;
    for (std::size_t k = begin; k < all.size(); ++k)
        radius_squared = std::max(radius_squared, (at(k) - centre).squaredNorm());
    sources.blocks.add(centre, normal.normalized(), power);
    sources.far_squared.push_back(kFarRadii * kFarRadii * radius_squared);
    sources.begin.push_back(all.size());
}

Sources sources_from(const ReliefSamples& samples, const Relief& relief,
                     const ReliefIrradiance& irradiance) {
    const std::vector<Eigen::Array4f> power = sample_powers(samples, relief, irradiance);
    Sources sources;
    sources.begin.push_back(0);
    for (const std::size_t side : {std::size_t{0}, samples.front_count}) {
        for (int by = 0; by < samples.cell.height(); by += kBlockCells) {
            for (int bx = 0; bx < samples.cell.width(); bx += kBlockCells) {
                for (int j = 0; j < kBlockCells; ++j) {
                    for (int i = 0; i < kBlockCells; ++i) {
                        if (!samples.cell.contains(bx + i, by + j)) continue;
                        const std::int32_t cell = samples.cell(bx + i, by + j);
                        if (cell < 0) continue;
                        const std::size_t k = side + static_cast<std::size_t>(cell);
                        sources.samples.add(samples.position[k], samples.normal[k], power[k]);
                    }
                }
                add_block(sources);
            }
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
    const Emitters all = all_samples(samples, sample_powers(samples, relief, irradiance));
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
                    gather_all(relief.point(x, y), relief.normals(x, y), all, table, body, q_max)
                        .head<3>();
                result(x, y) = (far + near_share * irradiance.front(x, y)) *
                               static_cast<float>(
                                   leaving_transmittance(relief.normals(x, y), options.eta) / kPi);
            }
        });
    return result;
}

}  // namespace vitrine
