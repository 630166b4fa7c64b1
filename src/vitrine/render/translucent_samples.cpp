#include "render/translucent_samples.h"

#include "base/parallel.h"
#include "image/filter.h"
#include "image/pixel_box.h"

#include <array>
#include <map>

namespace vitrine {

double entering_irradiance(const Vec3f& normal, const Vec3& direction, double eta) {
    const double cosine = normal.cast<double>().dot(direction);
    return cosine <= 0 ? 0 : cosine * fresnel_transmittance(cosine, eta);
}

namespace {

ReliefSamples sample_balls(const Relief& relief, int count) {
    double area = 0;
    for (const Ball& ball : relief.balls) area += 4 * kPi * ball.radius_px * ball.radius_px;
    ReliefSamples samples;
    samples.step_px = std::sqrt(area / count);
    const double golden = kPi * (3 - std::sqrt(5.0));
    for (std::size_t k = 0; k < relief.balls.size(); ++k) {
        const Ball& ball = relief.balls[k];
        const double ball_area = 4 * kPi * ball.radius_px * ball.radius_px;
        const int share = std::max(30, static_cast<int>(count * ball_area / area));
        for (int i = 0; i < share; ++i) {
            const double z = 1 - 2 * (i + 0.5) / share, rho = std::sqrt(1 - z * z);
            const Vec3f n =
                Vec3(rho * std::cos(golden * i), rho * std::sin(golden * i), z).cast<float>();
            samples.normal.push_back(n);
            samples.position.push_back(ball.centre_px + ball.radius_px * n);
            samples.area_px2.push_back(static_cast<float>(ball_area / share));
            samples.ball.push_back(static_cast<std::int16_t>(k));
        }
    }
    samples.front_count = samples.position.size();
    return samples;
}

/// A jump is one that the normals on both sides do not explain: more than this many times the
/// steeper slope, and than this many pixels.
constexpr double kJumpSlopes = 2, kJumpPx = 2;
/// Slopes of steeper normals are not known better than to a pixel.
constexpr float kMinSlopeCos = 0.05f;

/// Collects walls per lattice cell, layer of a step and direction.
class WallSums {
  public:
    explicit WallSums(const ReliefSamples& samples) : samples_(samples) {}

    /// The wall between pixel (x, y) and the next one along an axis, from height `top` down.
    void add(int x, int y, bool is_column, bool faces_next, double top, double height) {
        const int layers = std::max(1, static_cast<int>(std::ceil(height / samples_.step_px)));
        const double sign = faces_next ? 1 : -1;
        const Vec3 normal = is_column ? Vec3(0, -sign, 0) : Vec3(sign, 0, 0);
        for (int k = 0; k < layers; ++k) {
            const Vec3 middle(x + (is_column ? 0 : 0.5), -(y + (is_column ? 0.5 : 0)),
                              top - height * (k + 0.5) / layers);
            Sum& sum = sums_[{static_cast<int>((x - samples_.origin_x) / samples_.step_px),
                              static_cast<int>((y - samples_.origin_y) / samples_.step_px),
                              static_cast<int>(std::floor(middle.z() / samples_.step_px)),
                              2 * (is_column ? 1 : 0) + (faces_next ? 1 : 0)}];
            const double area = height / layers;
            sum.position += area * middle;
            sum.normal = normal;
            sum.area += area;
        }
    }

    void append_to(ReliefSamples& samples) const {
        for (const auto& [place, sum] : sums_) {
            samples.position.push_back((sum.position / sum.area).cast<float>());
            samples.normal.push_back(sum.normal.cast<float>());
            samples.area_px2.push_back(static_cast<float>(sum.area));
        }
    }

  private:
    struct Sum {
        Vec3 position = Vec3::Zero(), normal = Vec3::Zero();
        double area = 0;
    };
    const ReliefSamples& samples_;
    std::map<std::array<int, 4>, Sum> sums_;
};

/// What closes the surface where the height jumps: a nearer part hides its own side from the
/// camera, not from the lamps.
void add_walls(const Relief& relief, ReliefSamples& samples) {
    const auto slope = [&](int x, int y, bool is_column) {
        const Vec3f& n = relief.normals(x, y);
        return (is_column ? n.y() : -n.x()) / std::max(n.z(), kMinSlopeCos);
    };
    WallSums walls(samples);
    for (const bool is_column : {false, true}) {
        for (int y = 0; y < relief.mask.height(); ++y) {
            for (int x = 0; x < relief.mask.width(); ++x) {
                const int u = is_column ? x : x + 1, v = is_column ? y + 1 : y;
                if (!relief.mask.contains(u, v)) continue;
                if (!is_inside(relief.mask, x, y) || !is_inside(relief.mask, u, v)) continue;
                const double here = relief.depth_px(x, y), next = relief.depth_px(u, v);
                const double jump = std::abs(next - here);
                const double a = slope(x, y, is_column), b = slope(u, v, is_column);
                if (jump <= std::max(kJumpPx, kJumpSlopes * std::max(std::abs(a), std::abs(b))))
                    continue;
                walls.add(x, y, is_column, here > next, std::max(here, next),
                          jump - 0.5 * std::abs(a + b));
            }
        }
    }
    walls.append_to(samples);
}

}  // namespace

ReliefSamples sample_relief(const Relief& relief, int per_side) {
    VITRINE_CHECK_GT(per_side, 0);
    if (relief.is_cluster()) return sample_balls(relief, 2 * per_side);
    const Mask& mask = relief.mask;
    const std::size_t inside = count_inside(mask);
    VITRINE_CHECK_GT(inside, 0u);
    const PixelBox box = PixelBox::of(mask);
    const int x0 = box.x0, y0 = box.y0, x1 = box.x1 - 1, y1 = box.y1 - 1;
    ReliefSamples samples;
    // Whole pixels: cells of unequal size would alias narrow kernels.
    samples.step_px = std::max(1.0, std::round(std::sqrt(static_cast<double>(inside) / per_side)));
    samples.origin_x = x0;
    samples.origin_y = y0;
    const double step = samples.step_px;
    const int columns = static_cast<int>((x1 - x0) / step) + 1;
    const int rows = static_cast<int>((y1 - y0) / step) + 1;
    samples.cell = Image<std::int32_t>(columns, rows, -1);

    struct Sum {
        Vec3 position = Vec3::Zero(), normal = Vec3::Zero(), back_normal = Vec3::Zero();
        double back = 0;
        double area = 0, count = 0;
    };
    std::vector<Sum> sums(samples.cell.size());
    for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
            if (!is_inside(mask, x, y)) continue;
            Sum& sum =
                sums[static_cast<std::size_t>((y - y0) / step) * static_cast<std::size_t>(columns) +
                     static_cast<std::size_t>((x - x0) / step)];
            const Vec3f& n = relief.normals(x, y);
            const double area = 1 / std::max(n.z(), kMinAreaCos);
            sum.position += relief.point(x, y).cast<double>();
            sum.back += relief.back_px(x, y);
            sum.normal += n.cast<double>() * area;
            sum.back_normal += relief.back_normal(x, y).cast<double>() * area;
            sum.area += area;
            sum.count += 1;
        }
    }
    std::vector<float> back;
    std::vector<Vec3f> back_normal;
    for (std::size_t k = 0; k < sums.size(); ++k) {
        if (sums[k].count == 0) continue;
        back.push_back(static_cast<float>(sums[k].back / sums[k].count));
        back_normal.push_back(sums[k].back_normal.normalized().cast<float>());
        samples.cell[k] = static_cast<std::int32_t>(samples.position.size());
        samples.position.push_back((sums[k].position / sums[k].count).cast<float>());
        samples.normal.push_back(sums[k].normal.normalized().cast<float>());
        samples.area_px2.push_back(static_cast<float>(sums[k].area));
    }
    samples.front_count = samples.position.size();
    for (std::size_t k = 0; k < samples.front_count; ++k) {
        const Vec3f p = samples.position[k];
        samples.position.push_back({p.x(), p.y(), back[k]});
        samples.normal.push_back(back_normal[k]);
        samples.area_px2.push_back(samples.area_px2[k]);
    }
    if (relief.is_measured) add_walls(relief, samples);
    return samples;
}

ReliefIrradiance irradiance_from_lights(const Relief& relief, const ViewLights& lights,
                                        double eta) {
    ReliefIrradiance result{ImageRgb(relief.mask.width(), relief.mask.height()),
                            ImageRgb(relief.mask.width(), relief.mask.height())};
    parallel_for(static_cast<std::size_t>(relief.mask.height()), 8, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < relief.mask.width(); ++x) {
            if (!is_inside(relief.mask, x, y)) continue;
            const Vec3f n = relief.normals(x, y), n_back = relief.back_normal(x, y);
            Rgbd front = lights.ambient + lights.from_below * facing_down(n);
            Rgbd back = lights.ambient + lights.from_below * facing_down(n_back);
            for (const ViewLight& light : lights.lights) {
                front += light.intensity * entering_irradiance(n, light.direction, eta);
                back += light.intensity * entering_irradiance(n_back, light.direction, eta);
            }
            result.front(x, y) = front.cast<float>();
            result.back(x, y) = back.cast<float>();
        }
    });
    return result;
}

double normalise_lights(ViewLights& lights, const Relief& relief, double eta) {
    const ReliefIrradiance irradiance = irradiance_from_lights(relief, lights, eta);
    float brightest = 0;
    for (std::size_t i = 0; i < relief.mask.size(); ++i)
        if (relief.mask[i] > 127) brightest = std::max(brightest, luminance(irradiance.front[i]));
    if (brightest <= 0) return 1;
    const double factor = kPi / brightest;
    for (ViewLight& light : lights.lights) light.intensity *= factor;
    lights.ambient *= factor;
    lights.from_below *= factor;
    return factor;
}

}  // namespace vitrine
