#include "random_walk.h"

#include "base/parallel.h"
#include "base/rng.h"
#include "math/sampling.h"
#include "optics/fresnel.h"

#include <cmath>

namespace vitrine {
namespace {

struct Departure {
    Vec3f position;
    Rgb power;
};

class Walker {
  public:
    Walker(const Accel& accel, const WalkMedium& medium) : accel_(accel), medium_(medium) {}

    void walk(const WalkPhoton& photon, Rng& rng, std::vector<Departure>& departures) const {
        const Hit entry = accel_.closest({photon.origin, photon.direction});
        if (!entry.is_hit()) return;
        Vec3f position = photon.origin + entry.distance * photon.direction;
        const float cosine = std::min(1.0f, -entry.normal.dot(photon.direction));
        float cos_t = 0;
        Rgb weight = Rgb::Constant(1 - fresnel_dielectric(cosine, medium_.eta, cos_t));
        Vec3f direction = refract(-photon.direction, entry.normal, medium_.eta, cos_t).normalized();
        while (true) {
            const float free =
                static_cast<float>(-std::log1p(-rng.next_double()) / medium_.sigma_t_per_m);
            const Hit wall = accel_.closest({position, direction, kStart, free});
            if (!wall.is_hit()) {
                position += free * direction;
                weight *= medium_.albedo;
                direction = sample_uniform_sphere({rng.next_float(), rng.next_float()});
                if (!survives(weight, rng)) return;
                continue;
            }
            position += wall.distance * direction;
            const Vec3f normal = wall.normal.dot(direction) > 0 ? wall.normal : Vec3f(-wall.normal);
            const float f = fresnel_dielectric(std::min(1.0f, direction.dot(normal)),
                                               1.0f / medium_.eta, cos_t);
            if (rng.next_float() >= f) {
                departures.push_back({position, photon.power * weight});
                return;
            }
            direction = (direction - 2 * direction.dot(normal) * normal).normalized();
            position -= kStart * normal;
        }
    }

  private:
    static bool survives(Rgb& weight, Rng& rng) {
        constexpr float kSure = 0.1f;
        const float chance = weight.maxCoeff() / kSure;
        if (chance >= 1) return true;
        if (rng.next_float() >= chance) return false;
        weight /= chance;
        return true;
    }

    static constexpr float kStart = 1e-7f;  // metres: off the wall just met

    const Accel& accel_;
    const WalkMedium& medium_;
};

}  // namespace

void walk_photons(const Accel& accel, const WalkMedium& medium, std::size_t count,
                  std::uint64_t seed, const std::function<WalkPhoton(std::size_t)>& emit,
                  const std::function<void(const Vec3f& position, const Rgb& power)>& left) {
    constexpr std::size_t kBlock = 4096;
    std::vector<std::vector<Departure>> blocks((count + kBlock - 1) / kBlock);
    const Walker walker(accel, medium);
    parallel_for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Rng rng(stream_key(seed, i));
            walker.walk(emit(i), rng, blocks[begin / kBlock]);
        }
    });
    for (const auto& block : blocks) {
        for (const Departure& d : block) left(d.position, d.power);
    }
}

}  // namespace vitrine
