// compose/transfer.h: the material of the object in one photograph on the object of another.
//
// "Material photo": gives R_d. "Object photo": keeps its silhouette, shape, light, highlights and
// background. Viewer frame, pixels.
#pragma once

#include "capture/photo.h"
#include "estimate/back_surface.h"
#include "estimate/bssrdf.h"
#include "estimate/front_refinement.h"
#include "estimate/highlights.h"
#include "estimate/lopez_moreno.h"
#include "estimate/translucency_lights.h"
#include "reconstruct/balls.h"
#include "reconstruct/relief.h"
#include "render/translucent_relief.h"

#include <array>
#include <memory>
#include <optional>

namespace vitrine {

enum class LightMethod {
    Diffusion,    ///< estimate/translucency_lights.h
    LopezMoreno,  ///< estimate/lopez_moreno.h, as published
};

/// Where the light on the visible side of the object comes from.
enum class IrradianceSource {
    Photo,   ///< the photo itself: its diffuse shading is taken as irradiance, so shadows and light
             ///< bounced from the table stay; only the unseen back side comes from the lights
    Lights,  ///< the estimated lights on both sides, as published
};

enum class HighlightTransfer {
    Residual,  ///< what was taken off the object photo is put back
    Phong,     ///< as published: a Phong lobe with H as gloss map
};

/// What the object's shape is taken for.
enum class ShapeModel {
    Auto,      ///< a cluster of balls where their outlines make up the object, else one body
    Inflated,  ///< one body, as published
};

struct TransferAnalysisOptions {
    HighlightOptions highlights;
    ReliefOptions relief;
    ShapeModel shape = ShapeModel::Auto;
    BallOptions balls;
    /// Of a material photo's one body: shape by the lights found, then lights again, so often.
    int refinement_rounds = 2;
    bool use_back = true;          ///< of the same: how thick it is where light shines through
    FrontRefinementOptions front;  ///< of the same, last: until its rendering is the photo
    BackSurfaceOptions back;
    LightMethod light_method = LightMethod::Diffusion;
    /// How firmly the roles are believed: 1, the material photo is soft because of its material
    /// and the object photo because of its light; 0.5, no opinion.
    double softness = 1.0;
    TranslucencyLightOptions lights;  ///< `softness` there is set from the role
    BssrdfOptions bssrdf;
    bool is_object_neutral = false;  ///< the object is white: its colours are those of the light
};

/// What was learned of one photograph.
struct PhotoAnalysis {
    Photo photo;
    double white = 1;  ///< linear value shown as white
    Highlights highlights;
    Relief relief;
    std::vector<HighlightLight> highlight_lights;  ///< heaviest first
    ViewLightsEstimate lights;                     ///< where the lamps are
    /// Of a material photo: the light under which R_d is read. Of one body it is not where the
    /// lamps are but what explains the picture best on its inflated shape; else the same.
    ViewLightsEstimate explaining;
    std::vector<std::string> warnings;
};

/// The material photo: everything up to the lights, then R_d.
struct LiftedMaterial {
    PhotoAnalysis analysis;
    MediumEstimate medium;
    double brightness = 1;    ///< the light is this much stronger than assumed (limit_albedo)
    ImageRgb rendered;        ///< the material photo's object rendered with what was found
    double self_psnr_db = 0;  ///< of that against the photo without highlights, encoded sRGB
    double flat_psnr_db = 0;  ///< of the best single colour, for comparison
};
LiftedMaterial lift_material(const Photo& photo, const TransferAnalysisOptions& options = {},
                             const Progress& progress = {});

PhotoAnalysis analyse_object(const Photo& photo, const TransferAnalysisOptions& options = {},
                             const Progress& progress = {});

struct AnalysedPair {
    LiftedMaterial material;
    PhotoAnalysis object;
};
/// Both at once, which fills the cores better than one after the other. `progress` tells of the
/// material photo, the longer part.
AnalysedPair analyse_pair(const Photo& material_photo, const Photo& object_photo,
                          const TransferAnalysisOptions& options = {},
                          const Progress& progress = {});

struct TransferLook {
    double scale = 1;     ///< factor on the material's lengths: more is more translucent
    double exposure = 1;  ///< factor on the diffuse light
    double highlight_gain = 1;
    bool keep_colour = true;  ///< a scaled material keeps its mean colour on this object
    HighlightTransfer highlights = HighlightTransfer::Residual;
    double phong_exponent = 50;     ///< of `Phong`; the paper's is 5
    double highlight_weight = 0.5;  ///< share of the highlight light in `Phong`, rest to the others
    double added_gloss = 0;         ///< strength of a highlight added to a matte object
    double added_gloss_exponent = 80;
    /// As published: translucent shadow maps under the object's lights in place of the lattice sum.
    bool use_shadow_maps = false;
    double object_albedo = 0.7;  ///< assumed of the object as photographed: sets the light's level
};

/// Pixels of the object photo per pixel of the material photo: how lengths carry over.
/// Metric when both scales are known, else the same share of the object's inradius.
double length_ratio(double source_inradius_px, double target_inradius_px, double source_px_per_m,
                    double target_px_per_m);

struct TransferPicture {
    ImageRgb diffuse;  ///< inside the mask, linear, units of the object photo
    ImageRgb picture;  ///< the finished photograph, linear; untouched outside the feathered mask
};

/// Holds what does not depend on material and look; each change costs one coarse sum and a few
/// passes over the picture (about 0.1 s per megapixel).
class TransferSession {
  public:
    TransferSession(PhotoAnalysis object, IrradianceSource irradiance = IrradianceSource::Photo,
                    const TranslucentRenderOptions& options = {}, bool is_object_neutral = false,
                    double object_albedo = 0.7);

    /// The last two materials' diffuse light is kept: a change of exposure or gloss does not ask
    /// for it again. Not for several threads at once.
    /// @param profile of the material, in pixels of this photo (RadialProfile::scaled)
    TransferPicture render(const RadialProfile& profile, const TransferLook& look) const;

    /// New lights on the same object; switches the visible side to them.
    void set_lights(const ViewLights& lights);

    const PhotoAnalysis& object() const { return object_; }
    const ReliefIrradiance& irradiance() const { return irradiance_; }

  private:
    struct Lit {
        RadialProfile material;
        bool use_shadow_maps = false;
        ImageRgb diffuse;
    };
    const ImageRgb& diffuse_of(const RadialProfile& material, bool use_shadow_maps) const;
    ImageRgb highlight_layer(const TransferLook& look) const;

    PhotoAnalysis object_;
    TranslucentRenderOptions options_;
    std::unique_ptr<TranslucentRelief> renderer_;
    ReliefIrradiance irradiance_;
    double level_ = 1;  ///< linear value of the photo where irradiance is pi on white
    ImageF alpha_;      ///< feathered mask
    std::vector<std::array<std::size_t, 2>> rim_;  ///< feather pixel outside, nearest inside
    mutable std::vector<Lit> lit_;                 ///< under the present light, the latest last
};

/// The object recoloured as if opaque: albedo times irradiance over pi. The baseline.
ImageRgb lambertian_recolouring(const Relief& relief, const ReliefIrradiance& irradiance,
                                const Rgbd& albedo);

}  // namespace vitrine
