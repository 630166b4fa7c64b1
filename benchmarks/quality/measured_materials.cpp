// Ward lobes of measured paints against published fits, with plots of the residuals:
//   VITRINE_REAL_DATA=... vitrine_measured_materials [OUT]
// The data may not be published, nor may pictures made from them: OUT stays with the reader.
#include "base/file.h"
#include "estimate/measured_reflectance.h"
#include "pipeline/svg_plot.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

using namespace vitrine;

namespace {

constexpr int kWavelength = 600;

struct Published {
    const char* name;
    double rho_d, rho_s, sigma;  ///< 0: none published
};

/// ln(measured / model) over the angle of the half vector.
std::string residual_plot(const std::vector<ReflectanceSample>& samples, const MeasuredWard& fit,
                          const std::string& title) {
    const ReflectanceFitOptions options;
    const double least = std::cos(radians(options.max_angle_deg));
    std::vector<PlotPoint> used, steep;
    for (const ReflectanceSample& s : samples) {
        if (s.value <= 0.0) continue;
        const double half = degrees(angle_between(s.to_light + s.to_viewer, Vec3(0, 0, 1)));
        const double r = std::log(s.value / ward_value(fit, s));
        (s.to_light.z() < least || s.to_viewer.z() < least ? steep : used).push_back({half, r});
    }
    SvgPlot plot("angle of the half vector, degrees", "ln(measured / Ward)", {0, 80}, {-2, 3});
    plot.line({{0, 0}, {80, 0}}, "stroke=\"#888\" stroke-width=\"1\"");
    plot.dots(steep, 1.5, "fill=\"#d08a3c\"");
    plot.dots(used, 1.5, "fill=\"#2a7fb8\"");
    return plot.svg(title + " (orange: steeper than 65 degrees, not fitted)");
}

std::string compared(double value, double published) {
    if (published == 0.0) return fmt::format("{:.4f}", value);
    return fmt::format("{:.4f} ({:.3f}, {:+.1f} %)", value, published,
                       100 * (value / published - 1));
}

}  // namespace

int main(int argc, char** argv) {
    const char* root = std::getenv("VITRINE_REAL_DATA");
    if (!root) {
        std::printf("skipped: VITRINE_REAL_DATA is not set\n");
        return 0;
    }
    const std::filesystem::path out = argc > 1 ? argv[1] : "measured_materials_plots";
    std::filesystem::create_directories(out);
    fmt::print("| paint | rho_d | rho_s | sigma | rms of ln | samples | outcome |\n");
    fmt::print("|---|---|---|---|---|---|---|\n");
    for (const Published& p :
         {Published{"garnet_red", 0.060, 0.084, 0.267},
          Published{"krylon_blue", 0.009, 0.048, 0.255}, Published{"cayman", 0, 0, 0},
          Published{"mystique", 0, 0, 0}, Published{"acryl_blue", 0, 0, 0}}) {
        const std::vector<ReflectanceSample> samples = read_cornell_brdf(
            std::filesystem::path(root) / "measured_materials" / (std::string(p.name) + ".brdf"),
            kWavelength);
        const MeasuredWard fit = fit_measured_ward(samples);
        fmt::print("| {} | {} | {} | {} | {:.3f} | {} of {} | {} |\n", p.name,
                   compared(fit.rho_d, p.rho_d), compared(fit.rho_s, p.rho_s),
                   compared(fit.sigma.value, p.sigma), fit.residual_rms, fit.sample_count,
                   samples.size(), outcome_name(fit.sigma.outcome));
        write_text_file(out / (std::string(p.name) + ".svg"), residual_plot(samples, fit, p.name));
    }
    fmt::print("residual plots: {}\n", out.string());
}
