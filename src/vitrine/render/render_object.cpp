#include "render/render_object.h"

#include "base/parallel.h"
#include "image/poisson.h"
#include "render/ball_bounce.h"

namespace vitrine {
namespace {

/// Values on the cells of the lattice of `samples` (from `begin` on), read between their centres.
template <typename T>
class LatticeField {
  public:
    LatticeField(const ReliefSamples& samples, const std::vector<T>& values, std::size_t begin)
        : samples_(samples), lattice_(samples.cell.width(), samples.cell.height()) {
        Mask known(lattice_.width(), lattice_.height());
        for (std::size_t k = 0; k < lattice_.size(); ++k) {
            if (samples.cell[k] < 0) continue;
            lattice_[k] = values[begin + static_cast<std::size_t>(samples.cell[k])];
            known[k] = 255;
        }
        lattice_ = extend_nearest(lattice_, known);
    }
    T operator()(int x, int y) const {
        const double u = (x + 0.5 - samples_.origin_x) / samples_.step_px - 0.5;
        const double v = (y + 0.5 - samples_.origin_y) / samples_.step_px - 0.5;
        const int x0 = static_cast<int>(std::floor(u)), y0 = static_cast<int>(std::floor(v));
        const auto s = static_cast<float>(u - x0), t = static_cast<float>(v - y0);
        return (1 - t) * ((1 - s) * lattice_.clamped(x0, y0) + s * lattice_.clamped(x0 + 1, y0)) +
               t * ((1 - s) * lattice_.clamped(x0, y0 + 1) + s * lattice_.clamped(x0 + 1, y0 + 1));
    }

  private:
    const ReliefSamples& samples_;
    Image<T> lattice_;
};

/// A ball alone, in a picture of its own; (x, y) there is (x + left, y + top) in the photo.
struct LocalBall {
    Relief relief;
    int left = 0, top = 0;
};

LocalBall local_ball(const Ball& ball) {
    LocalBall local;
    const double r = ball.radius_px;
    local.left = static_cast<int>(std::floor(ball.centre_px.x() - r)) - 1;
    local.top = static_cast<int>(std::floor(-ball.centre_px.y() - r)) - 1;
    const int size = static_cast<int>(std::ceil(2 * r)) + 4;
    Relief& relief = local.relief;
    relief.mask = Mask(size, size);
    relief.depth_px = ImageF(size, size);
    relief.normals = Image<Vec3f>(size, size, Vec3f(0, 0, 1));
    relief.inradius_px = r;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double u = x + local.left - ball.centre_px.x();
            const double v = -(y + local.top) - ball.centre_px.y();
            const double rest = r * r - u * u - v * v;
            if (rest <= 0) continue;
            relief.mask(x, y) = 255;
            relief.depth_px(x, y) = static_cast<float>(std::sqrt(rest));
            relief.normals(x, y) = (Vec3(u, v, std::sqrt(rest)) / r).cast<float>();
        }
    }
    return local;
}

/// Cells of each side of a ball on which soft light is computed.
constexpr int kSoftCells = 300;

/// Light on both sides of one ball among the others: lamps at every pixel, as their shadows have
/// edges; the rest on a lattice.
ReliefIrradiance ball_irradiance(const Relief& cluster, std::size_t k, const LocalBall& local,
                                 const ViewLights& lights, const Occluder& occluder,
                                 const SoftBallLight& soft_light, double eta) {
    const Ball& ball = cluster.balls[k];
    const Mask& mask = local.relief.mask;
    const ReliefSamples samples = sample_relief(local.relief, kSoftCells);
    std::vector<Vec3f> centres;
    for (const Vec3f& n : samples.normal) centres.push_back(ball.centre_px + ball.radius_px * n);
    const std::vector<std::int16_t> cell_ball(centres.size(), static_cast<std::int16_t>(k));
    const std::vector<Rgb> soft = soft_light.at({centres, samples.normal, cell_ball});

    ReliefIrradiance result{ImageRgb(mask.width(), mask.height()),
                            ImageRgb(mask.width(), mask.height())};
    for (const bool is_front : {true, false}) {
        std::vector<Vec3f> position, normal;
        for (std::size_t i = 0; i < mask.size(); ++i) {
            if (mask[i] <= 127) continue;
            const Vec3f n = local.relief.normals[i];
            normal.emplace_back(n.x(), n.y(), is_front ? n.z() : -n.z());
            position.push_back(ball.centre_px + ball.radius_px * normal.back());
        }
        const std::vector<std::int16_t> own(position.size(), static_cast<std::int16_t>(k));
        const std::vector<Rgb> lamps =
            lamp_light(occluder, {position, normal, own}, lights, eta, true);
        const LatticeField<Rgb> field(samples, soft, is_front ? 0 : samples.front_count);
        ImageRgb& side = is_front ? result.front : result.back;
        std::size_t next = 0;
        for (int y = 0; y < mask.height(); ++y)
            for (int x = 0; x < mask.width(); ++x)
                if (is_inside(mask, x, y)) side(x, y) = lamps[next++] + field(x, y);
    }
    return result;
}

ImageRgb render_cluster(const Relief& relief, const ViewLights& lights,
                        const RadialProfile& profile, const TranslucentRenderOptions& options) {
    ImageRgb result(relief.mask.width(), relief.mask.height());
    Mask known(result.width(), result.height());
    const Occluder occluder(relief);
    const SoftBallLight soft(relief, lights, options.eta);
    for (std::size_t k = 0; k < relief.balls.size(); ++k) {
        const LocalBall local = local_ball(relief.balls[k]);
        const ReliefIrradiance irradiance =
            ball_irradiance(relief, k, local, lights, occluder, soft, options.eta);
        const ImageRgb picture =
            TranslucentRelief(local.relief, options).render(irradiance, profile);
        for (int y = 0; y < picture.height(); ++y) {
            for (int x = 0; x < picture.width(); ++x) {
                const int column = x + local.left, row = y + local.top;
                if (!is_inside(local.relief.mask, x, y) || !result.contains(column, row)) continue;
                if (relief.ball_of(column, row) != static_cast<std::int16_t>(k)) continue;
                result(column, row) = picture(x, y);
                known(column, row) = 255;
            }
        }
    }
    result = extend_nearest(result, known);
    for (std::size_t i = 0; i < result.size(); ++i)
        if (relief.mask[i] <= 127) result[i].setZero();
    return result;
}

}  // namespace

ReliefIrradiance irradiance_with_shadows(const Relief& relief, const ViewLights& lights,
                                         double eta) {
    constexpr int kShadowCells = 2500;
    const ReliefSamples samples = sample_relief(relief, kShadowCells);
    const SurfacePoints points{samples.position, samples.normal, samples.ball};
    const Occluder occluder(relief);
    const SkyShares sky = sky_shares(occluder, points);
    ReliefIrradiance result{ImageRgb(relief.mask.width(), relief.mask.height()),
                            ImageRgb(relief.mask.width(), relief.mask.height())};
    for (const bool is_front : {true, false}) {
        ImageRgb& side = is_front ? result.front : result.back;
        const std::size_t begin = is_front ? 0 : samples.front_count;
        const LatticeField<float> ambient(samples, sky.ambient, begin);
        const LatticeField<float> below(samples, sky.below, begin);
        std::vector<LatticeField<float>> seen;
        for (const ViewLight& light : lights.lights)
            seen.emplace_back(samples, occluder.visibility(points, light.direction), begin);
        parallel_for(static_cast<std::size_t>(side.height()), 8, [&](std::size_t row) {
            const int y = static_cast<int>(row);
            for (int x = 0; x < side.width(); ++x) {
                if (!is_inside(relief.mask, x, y)) continue;
                const Vec3f n = is_front ? relief.normals(x, y) : relief.back_normal(x, y);
                Rgbd sum = lights.ambient * ambient(x, y) + lights.from_below * below(x, y);
                for (std::size_t l = 0; l < seen.size(); ++l) {
                    const ViewLight& light = lights.lights[l];
                    const double e = entering_irradiance(n, light.direction, eta);
                    if (e > 0) sum += light.intensity * (e * seen[l](x, y));
                }
                side(x, y) = sum.cast<float>();
            }
        });
    }
    return result;
}

ImageRgb render_object(const Relief& relief, const ViewLights& lights, const RadialProfile& profile,
                       const TranslucentRenderOptions& options) {
    if (relief.is_cluster()) return render_cluster(relief, lights, profile, options);
    return TranslucentRelief(relief, options)
        .render(irradiance_with_shadows(relief, lights, options.eta), profile);
}

}  // namespace vitrine
