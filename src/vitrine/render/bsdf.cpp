#include "render/bsdf.h"

#include "math/sampling.h"
#include "optics/fresnel.h"
#include "optics/ward.h"

namespace vitrine {
namespace {

template <typename... Functions>
struct Overloaded : Functions... {
    using Functions::operator()...;
};
template <typename... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

float diffuse_share(const WardBsdf& ward) {
    const float d = luminance(ward.rho_d), s = luminance(ward.rho_s);
    return d + s > 0 ? d / (d + s) : 1.0f;
}

float ward_pdf(const WardBsdf& ward, const Vec3f& wo, const Vec3f& wi) {
    if (wo.z() <= 0 || wi.z() <= 0) return 0.0f;
    const Vec3f h = (wo + wi).normalized();
    const float cos2 = h.z() * h.z();
    const float hx = h.x() / ward.sigma_x, hy = h.y() / ward.sigma_y;
    const float tan2 = (hx * hx + hy * hy) / cos2;
    // Walter 2005, "Notes on the Ward BRDF", eq. 9.
    return std::exp(-tan2) / (4 * kPif * ward.sigma_x * ward.sigma_y * h.dot(wi) * cos2 * h.z());
}

/// Chance that a translucent face sends a path on by its diffuse lobe.
float diffuse_share(const TranslucentBsdf& face) {
    if (face.sigma <= 0) return 1.0f;
    constexpr float kGlossyShare = 0.2f;  // reflects 3 to 5 %, more at grazing angles
    return std::clamp(luminance(face.near_share), 0.0f, 1.0f) > 0 ? 1.0f - kGlossyShare : 0.0f;
}

/// The lobe of the interface as a Ward lobe; Fresnel's factor is put to it apart.
WardBsdf gloss_of(const TranslucentBsdf& face) {
    return {Rgb::Zero(), Rgb::Ones(), face.sigma, face.sigma, false};
}

float gloss_fresnel(const TranslucentBsdf& face, const Vec3f& wo, const Vec3f& wi) {
    const Vec3f h = (wo + wi).normalized();
    return 1.0f - fresnel_transmittance(wo.dot(h), face.eta);
}

Rgb ward_value(const WardBsdf& ward, const Vec3f& wo, const Vec3f& wi) {
    return ward.rho_s * static_cast<float>(ward_lobe(wo.cast<double>(), wi.cast<double>(),
                                                     ward.sigma_x, ward.sigma_y, ward.is_duer));
}

BsdfSample sample_ward_lobe(const WardBsdf& ward, const Vec3f& wo, const Vec2f& u) {
    BsdfSample result;
    result.lobe = Lobe::Glossy;
    // Half vector by inversion (Ward 1992, eq. 7 and 8); atan2 keeps the quadrant.
    const float angle = 2 * kPif * u.y();
    const float x = ward.sigma_x * std::cos(angle), y = ward.sigma_y * std::sin(angle);
    const float tan_h = std::sqrt(-std::log(1.0f - u.x())) * std::sqrt(x * x + y * y);
    const float phi = std::atan2(y, x);
    const Vec3f h = Vec3f(tan_h * std::cos(phi), tan_h * std::sin(phi), 1.0f).normalized();
    const float oh = wo.dot(h);
    result.wi = 2 * oh * h - wo;
    if (oh <= 0 || result.wi.z() <= 0) return result;
    const float density = ward_pdf(ward, wo, result.wi);
    if (!(density > 0)) return result;
    result.pdf = density;
    result.weight = ward_value(ward, wo, result.wi) * (result.wi.z() / density);
    return result;
}

}  // namespace

Rgb diffuse_reflectance(const Bsdf& bsdf) {
    if (const auto* d = std::get_if<DiffuseBsdf>(&bsdf)) return d->albedo;
    if (const auto* w = std::get_if<WardBsdf>(&bsdf)) return w->rho_d;
    if (const auto* t = std::get_if<TranslucentBsdf>(&bsdf)) {
        const float through = fresnel_transmittance(1.0f, t->eta);
        return t->near_share * (through * through);
    }
    return Rgb::Zero();
}

bool is_smooth(const Bsdf& bsdf) {
    return std::holds_alternative<MirrorBsdf>(bsdf) || std::holds_alternative<DielectricBsdf>(bsdf);
}

Rgb eval_lobe(const Bsdf& bsdf, Lobe lobe, const Vec3f& wo, const Vec3f& wi) {
    if (wo.z() <= 0 || wi.z() <= 0) return Rgb::Zero();
    return std::visit(
        Overloaded{[&](const DiffuseBsdf& d) -> Rgb {
                       return lobe == Lobe::Diffuse ? Rgb(d.albedo / kPif) : Rgb(Rgb::Zero());
                   },
                   [&](const WardBsdf& w) -> Rgb {
                       return lobe == Lobe::Diffuse ? Rgb(w.rho_d / kPif) : ward_value(w, wo, wi);
                   },
                   [](const MirrorBsdf&) -> Rgb { return Rgb::Zero(); },
                   [](const DielectricBsdf&) -> Rgb { return Rgb::Zero(); },
                   [&](const TranslucentBsdf& t) -> Rgb {
                       if (lobe == Lobe::Diffuse) {
                           return t.near_share * (fresnel_transmittance(wi.z(), t.eta) *
                                                  fresnel_transmittance(wo.z(), t.eta) / kPif);
                       }
                       if (t.sigma <= 0) return Rgb::Zero();
                       return ward_value(gloss_of(t), wo, wi) * gloss_fresnel(t, wo, wi);
                   },
                   [&](const EnteringBsdf& e) -> Rgb {
                       return lobe == Lobe::Diffuse
                                  ? Rgb(Rgb::Constant(fresnel_transmittance(wi.z(), e.eta) / kPif))
                                  : Rgb(Rgb::Zero());
                   }},
        bsdf);
}

Rgb eval(const Bsdf& bsdf, const Vec3f& wo, const Vec3f& wi) {
    return eval_lobe(bsdf, Lobe::Diffuse, wo, wi) + eval_lobe(bsdf, Lobe::Glossy, wo, wi);
}

float lobe_probability(const Bsdf& bsdf, Lobe lobe) {
    if (std::holds_alternative<DiffuseBsdf>(bsdf) || std::holds_alternative<EnteringBsdf>(bsdf)) {
        return lobe == Lobe::Diffuse ? 1.0f : 0.0f;
    }
    if (const auto* face = std::get_if<TranslucentBsdf>(&bsdf)) {
        const float share = diffuse_share(*face);
        return lobe == Lobe::Diffuse ? share : 1.0f - share;
    }
    if (const auto* ward = std::get_if<WardBsdf>(&bsdf)) {
        const float share = diffuse_share(*ward);
        return lobe == Lobe::Diffuse ? share : 1.0f - share;
    }
    return 0.0f;
}

float pdf_lobe(const Bsdf& bsdf, Lobe lobe, const Vec3f& wo, const Vec3f& wi) {
    if (is_smooth(bsdf) || wo.z() <= 0 || wi.z() <= 0) return 0.0f;
    if (lobe == Lobe::Diffuse) return pdf_cosine_hemisphere(wi.z());
    if (const auto* face = std::get_if<TranslucentBsdf>(&bsdf)) {
        return face->sigma > 0 ? ward_pdf(gloss_of(*face), wo, wi) : 0.0f;
    }
    const auto* ward = std::get_if<WardBsdf>(&bsdf);
    return ward ? ward_pdf(*ward, wo, wi) : 0.0f;
}

float pdf(const Bsdf& bsdf, const Vec3f& wo, const Vec3f& wi) {
    return lobe_probability(bsdf, Lobe::Diffuse) * pdf_lobe(bsdf, Lobe::Diffuse, wo, wi) +
           lobe_probability(bsdf, Lobe::Glossy) * pdf_lobe(bsdf, Lobe::Glossy, wo, wi);
}

BsdfSample sample(const Bsdf& bsdf, const Vec3f& wo, const Vec2f& u, float u_lobe) {
    BsdfSample result;
    if (wo.z() <= 0) return result;
    const auto diffuse = [&](const Rgb& albedo, float probability) {
        BsdfSample s;
        s.wi = sample_cosine_hemisphere(u);
        s.pdf = probability * pdf_cosine_hemisphere(s.wi.z());
        if (s.pdf > 0) s.weight = albedo / probability;
        return s;
    };
    return std::visit(Overloaded{[&](const DiffuseBsdf& d) { return diffuse(d.albedo, 1.0f); },
                                 [&](const WardBsdf& w) {
                                     const float share = diffuse_share(w);
                                     if (u_lobe < share) return diffuse(w.rho_d, share);
                                     BsdfSample s = sample_ward_lobe(w, wo, u);
                                     s.weight /= 1.0f - share;
                                     s.pdf *= 1.0f - share;
                                     return s;
                                 },
                                 [&](const TranslucentBsdf& t) {
                                     const float share = diffuse_share(t);
                                     if (u_lobe < share) {
                                         BsdfSample s = diffuse(t.near_share, share);
                                         s.weight *= fresnel_transmittance(s.wi.z(), t.eta) *
                                                     fresnel_transmittance(wo.z(), t.eta);
                                         return s;
                                     }
                                     BsdfSample s = sample_ward_lobe(gloss_of(t), wo, u);
                                     if (!(s.pdf > 0)) return s;
                                     s.weight *= gloss_fresnel(t, wo, s.wi) / (1.0f - share);
                                     s.pdf *= 1.0f - share;
                                     return s;
                                 },
                                 [&](const EnteringBsdf& e) {
                                     BsdfSample s = diffuse(Rgb::Ones(), 1.0f);
                                     s.weight *= fresnel_transmittance(s.wi.z(), e.eta);
                                     return s;
                                 },
                                 [&](const MirrorBsdf& m) {
                                     BsdfSample s;
                                     s.lobe = Lobe::Glossy;
                                     s.is_smooth = true;
                                     s.wi = Vec3f(-wo.x(), -wo.y(), wo.z());
                                     s.weight = m.reflectance;
                                     return s;
                                 },
                                 [&](const DielectricBsdf& d) {
                                     BsdfSample s;
                                     s.lobe = Lobe::Glossy;
                                     s.is_smooth = true;
                                     s.weight = Rgb::Ones();
                                     float cos_t;
                                     const float f = fresnel_dielectric(wo.z(), d.eta, cos_t);
                                     if (u_lobe < f) {
                                         s.wi = Vec3f(-wo.x(), -wo.y(), wo.z());
                                     } else {
                                         s.is_transmitted = true;
                                         s.wi = refract(wo, Vec3f(0, 0, 1), d.eta, cos_t);
                                         // Radiance is compressed into a smaller solid angle in the
                                         // denser medium (Veach 1997, section 5.2).
                                         s.weight /= d.eta * d.eta;
                                     }
                                     return s;
                                 }},
                      bsdf);
}

}  // namespace vitrine
