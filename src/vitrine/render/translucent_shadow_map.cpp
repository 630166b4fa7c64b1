#include "render/translucent_shadow_map.h"

#include "base/parallel.h"

#include <array>
#include <functional>

namespace vitrine {
namespace {

/// What one texel sees of the lit surface: entering power per texel of level 0, and the mean
/// position of where it enters.
struct Texel {
    Rgb power = Rgb::Zero();
    Vec3f moment = Vec3f::Zero();  ///< position times weight
    float weight = 0;
};

Texel operator+(const Texel& a, const Texel& b) {
    return {a.power + b.power, a.moment + b.moment, a.weight + b.weight};
}

/// The pyramid of one light: level k has texels of 2^k pixels.
class ShadowMap {
  public:
    /// @param direction toward the light, viewer frame
    ShadowMap(const Relief& relief, const Vec3& direction,
              const std::function<Rgb(const Vec3f& normal)>& entering)
        : right_(direction.unitOrthogonal().cast<float>()),
          up_(direction.cross(direction.unitOrthogonal()).cast<float>()) {
        const Vec3f toward = direction.cast<float>();
        Vec2f low = Vec2f::Constant(1e30f), high = Vec2f::Constant(-1e30f);
        for_each_pixel(relief, [&](int x, int y) {
            const Vec2f at = project(relief.point(x, y));
            low = low.cwiseMin(at);
            high = high.cwiseMax(at);
        });
        origin_ = low - Vec2f::Constant(2);
        const int width = static_cast<int>(high.x() - origin_.x()) + 4;
        const int height = static_cast<int>(high.y() - origin_.y()) + 4;
        // The surface nearest to the light hides the rest: a depth test, two pixels of slack.
        ImageF nearest(width, height, -1e30f);
        const auto texel_of = [&](const Vec3f& point) {
            const Vec2f at = project(point) - origin_;
            return std::array<int, 2>{static_cast<int>(at.x()), static_cast<int>(at.y())};
        };
        for_each_pixel(relief, [&](int x, int y) {
            const Vec3f p = relief.point(x, y);
            const auto [u, v] = texel_of(p);
            nearest(u, v) = std::max(nearest(u, v), p.dot(toward));
        });
        levels_.emplace_back(width, height);
        for_each_pixel(relief, [&](int x, int y) {
            const Vec3f p = relief.point(x, y), n = relief.normals(x, y);
            const auto [u, v] = texel_of(p);
            if (p.dot(toward) < nearest(u, v) - 2) return;
            const float area = 1 / std::max(n.z(), kMinAreaCos);
            Texel& texel = levels_[0](u, v);
            texel = texel + Texel{entering(n) * area, p * area, area};
        });
        while (std::min(levels_.back().width(), levels_.back().height()) > 4) {
            const Image<Texel>& fine = levels_.back();
            Image<Texel> coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2);
            for (int y = 0; y < fine.height(); ++y)
                for (int x = 0; x < fine.width(); ++x)
                    coarse(x / 2, y / 2) = coarse(x / 2, y / 2) + fine(x, y);
            levels_.push_back(std::move(coarse));
        }
    }

    int level_count() const { return static_cast<int>(levels_.size()); }

    /// 21 samples around `point`, with the power of `share` texels each.
    Rgbd gather(const Vec3f& point, int level, const RadialProfile& profile) const {
        const Vec2f at = project(point) - origin_;
        const auto side = static_cast<float>(1 << level);
        Rgbd sum = Rgbd::Zero();
        // Inner 4 x 4 texels by 3 x 3 samples, then the ring of 12 double ones around them.
        for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i)
                sum += sample(at + Vec2f(1.333f * side * i, 1.333f * side * j), level, 16.0 / 9,
                              point, profile);
        for (int j = 0; j < 4; ++j) {
            for (int i = 0; i < 4; ++i) {
                if ((i == 1 || i == 2) && (j == 1 || j == 2)) continue;
                sum += sample(at + 2 * side * Vec2f(i - 1.5f, j - 1.5f), level + 1, 1.0, point,
                              profile);
            }
        }
        return sum;
    }

  private:
    template <typename Visit>
    static void for_each_pixel(const Relief& relief, const Visit& visit) {
        for (int y = 0; y < relief.mask.height(); ++y)
            for (int x = 0; x < relief.mask.width(); ++x)
                if (is_inside(relief.mask, x, y)) visit(x, y);
    }
    Vec2f project(const Vec3f& p) const { return {p.dot(right_), p.dot(up_)}; }

    Rgbd sample(const Vec2f& at, int level, double share, const Vec3f& point,
                const RadialProfile& profile) const {
        const int k = std::min(level, level_count() - 1);
        const Image<Texel>& map = levels_[static_cast<std::size_t>(k)];
        const auto side = static_cast<float>(1 << k);
        const int x = static_cast<int>(std::floor(at.x() / side));
        const int y = static_cast<int>(std::floor(at.y() / side));
        if (!map.contains(x, y) || map(x, y).weight <= 0) return Rgbd::Zero();
        const Texel& texel = map(x, y);
        const Vec3f p = texel.moment / texel.weight;
        // Within its own texel a sample lies about a third of a side away, not at 0.
        const double r = std::max<double>((p - point).norm(), 0.38 * side);
        return share * profile.at(r) * texel.power.cast<double>();
    }

    Vec3f right_, up_;
    Vec2f origin_ = Vec2f::Zero();
    std::vector<Image<Texel>> levels_;
};

}  // namespace

ImageRgb render_translucent_shadow_maps(const Relief& relief, const ViewLights& lights,
                                        const RadialProfile& profile,
                                        const TranslucentRenderOptions& options) {
    std::vector<ShadowMap> maps;
    for (const ViewLight& light : lights.lights) {
        maps.emplace_back(relief, light.direction, [&](const Vec3f& n) -> Rgb {
            return (light.intensity * entering_irradiance(n, light.direction, options.eta))
                .cast<float>();
        });
    }
    maps.emplace_back(relief, Vec3(0, 0, 1), [&](const Vec3f& n) -> Rgb {
        return (lights.ambient + lights.from_below * facing_down(n)).cast<float>();
    });
    // The pattern spans 8 texels of its finer level.
    const double reach = 2 * profile.mean_radius().maxCoeff();
    int level = 0;
    while (level < 12 && 4 * std::pow(2.0, level) < reach) ++level;

    ImageRgb result(relief.mask.width(), relief.mask.height());
    parallel_for(static_cast<std::size_t>(result.height()), 4, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < result.width(); ++x) {
            if (!is_inside(relief.mask, x, y)) continue;
            Rgbd sum = Rgbd::Zero();
            for (const ShadowMap& map : maps) sum += map.gather(relief.point(x, y), level, profile);
            const double out = leaving_transmittance(relief.normals(x, y), options.eta);
            result(x, y) = (sum * (out / kPi)).cast<float>();
        }
    });
    return result;
}

}  // namespace vitrine
