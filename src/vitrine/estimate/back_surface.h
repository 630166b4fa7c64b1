// estimate/back_surface.h: how thick a body is where light from behind shines through it.
#pragma once

#include "estimate/bssrdf.h"

namespace vitrine {

struct BackSurfaceOptions {
    int rounds = 2;                ///< of R_d and the back in turn; 0: the back stays
    int observation_count = 1200;  ///< pixels compared
    int samples_per_side = 1500;   ///< of the surface
    int label_count = 7;           ///< thicknesses tried
    double thinnest = 0.06;        ///< in inradii
    double window = 0.12;          ///< reach of the pixels that decide together, in inradii
    double price = 0.5;            ///< of a step thinner, in medians of the misfit of thick places
    std::uint64_t seed = 1;        ///< of the choice of pixels
};

/// The unseen back, moved forward where the picture asks for it.
///
/// A single picture shows the front alone, and a back mirrored from it makes ears, petals and
/// brims as thick as they are wide. Light from behind tells: the picture is predicted with the
/// body capped at each of a few thicknesses T, back height = front - min(thickness, T), and each
/// place takes the cap that explains its neighbourhood best, thick ones first where it makes no
/// difference (cost volume filtering, Rhemann et al. 2011). Sound where thickness changes slowly
/// over a scattering length. Costs about 0.5 s.
/// @param start its thickness is the greatest allowed
/// @returns nothing where nothing is thinner than `start`, and for clusters
/// @param medium R_d under that light
std::optional<Relief> refine_back(const Relief& start, const ImageRgb& diffuse,
                                  const Mask& excluded, const EnteringLight& light,
                                  const MediumEstimate& medium,
                                  const BackSurfaceOptions& options = {});

/// `excluded` and the pixels under which the body was made thinner: they say more of its back than
/// of what it is made of.
Mask with_thin_parts(const Mask& excluded, const Relief& start, const Relief& refined);

struct BodyEstimate {
    Relief relief;
    MediumEstimate medium;
    bool has_thin_parts = false;  ///< light shines through some
};

/// R_d and the back in turn under known light; R_d last, without the thin parts.
BodyEstimate estimate_body(const Relief& start, const ImageRgb& diffuse, const Mask& excluded,
                           const EnteringLight& light, const BssrdfOptions& bssrdf = {},
                           const BackSurfaceOptions& back = {}, const Progress& progress = {});

/// The same front with the back where the thickness says.
Relief with_thickness(const Relief& relief, const ImageF& thickness_px);

/// Height of the front over the back; 0 outside.
ImageF thickness_of(const Relief& relief);

}  // namespace vitrine
