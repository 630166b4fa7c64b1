// render/medium_table.h: the media that paths get into, by number, so that what lies beyond a
// surface is looked up where it was found before.
#pragma once

#include "render/interface.h"

#include <vector>

namespace vitrine {

/// Numbers of `Media`, in the order in which they were met; 0 is air. Of one thread. A look-up
/// costs two reads of memory; a crossing that is new, a search through all media met so far.
class MediumTable {
  public:
    explicit MediumTable(const RenderScene& scene) : scene_(scene) { number_of(Media()); }

    /// What lies beyond a dielectric part's surface; see `Boundary`.
    struct Crossing {
        std::uint32_t beyond = kUnknown;
        float eta = 1.0f;
    };
    Crossing cross(std::uint32_t medium, int part, bool is_front) {
        const std::size_t k = 2 * static_cast<std::size_t>(part) + (is_front ? 1 : 0);
        const Crossing known = media_[medium].crossings[k];
        return known.beyond != kUnknown ? known : find(medium, part, is_front);
    }
    bool absorbs(std::uint32_t medium) const { return media_[medium].absorbs; }
    const Media& media(std::uint32_t medium) const { return media_[medium].media; }

  private:
    static constexpr std::uint32_t kUnknown = 0xffffffffu;
    struct Medium {
        Media media;
        bool absorbs;
        std::vector<Crossing> crossings;  // from inside and outside of each part
    };
    std::uint32_t number_of(const Media& media);
    Crossing find(std::uint32_t medium, int part, bool is_front);

    const RenderScene& scene_;
    std::vector<Medium> media_;
};

}  // namespace vitrine
