// scene/material.h: what a surface is made of. A closed set: to add a kind, add a struct, name it
// in the variant, and the compiler points at every place that must know it.
#pragma once

#include "image/image.h"

#include <memory>
#include <string>
#include <variant>
#include <vector>

namespace vitrine {

/// Lambertian. The albedo comes from the first of these that is set: texture (by uv), vertex
/// colours of the mesh, the constant.
struct Diffuse {
    Rgb albedo = Rgb::Constant(0.5f);
    std::shared_ptr<const ImageRgb> albedo_texture;  ///< linear; u right, v up
    std::string albedo_texture_file;                 ///< where it came from, for writing
    bool use_vertex_colours = false;
};

enum class WardForm {
    Ward,  ///< 1 / sqrt(cos_i cos_o), Ward 1992
    Duer,  ///< 1 / (cos_i cos_o), Duer 2006
};

/// Diffuse plus one Gaussian lobe. sigma_x = sigma_y is the isotropic case; x is the surface
/// tangent of `Frame` (anisotropic objects need uv to fix it).
struct Ward {
    Rgb rho_d = Rgb::Constant(0.2f);
    Rgb rho_s = Rgb::Constant(0.2f);
    double sigma_x = 0.1;
    double sigma_y = 0.1;
    WardForm form = WardForm::Ward;
};

struct Mirror {
    Rgb reflectance = Rgb::Constant(1.0f);
};

/// Smooth interface with exact Fresnel; inside, light decays as exp(-sigma_a s).
struct Dielectric {
    double ior = 1.5;
    Rgb sigma_a_per_m = Rgb::Zero();
};

/// Diffusion profile R_d(r) per channel on the surface, below a smooth interface.
struct Translucent {
    std::vector<double> r_m;      ///< radii of the table, increasing
    std::vector<Rgbd> rd_per_m2;  ///< R_d at those radii
    double eta = 1.3;
    double sigma = 0.0;           ///< roughness of the interface's reflection; 0: none
    std::string file;             ///< the material.json it came from
    double scale_px_per_m = 0.0;  ///< used to convert the file's pixels
};

using Material = std::variant<Diffuse, Ward, Mirror, Dielectric, Translucent>;

/// The JSON word: "diffuse", "ward", "mirror", "dielectric", "translucent".
std::string kind_name(const Material& material);

}  // namespace vitrine
