#include "pipeline/transfer_report.h"

#include "base/file.h"
#include "image/colour.h"
#include "image/filter.h"
#include "image/image_io.h"
#include "pipeline/report.h"
#include "render/translucent_samples.h"

#include <unistd.h>

namespace vitrine {
namespace {

namespace fs = std::filesystem;

/// Pictures of the page live in files only until they are embedded.
class ScratchFolder {
  public:
    ScratchFolder()
        : path_(fs::temp_directory_path() / fmt::format("vitrine_report_{}", ::getpid())) {
        fs::create_directories(path_);
    }
    ~ScratchFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    fs::path save(const std::string& name, const ImageRgb& linear, double scale = 1) const {
        const fs::path file = path_ / (name + ".png");
        write_png(file, linear_to_srgb8(linear, static_cast<float>(scale)));
        return file;
    }

  private:
    fs::path path_;
};

/// At most 700 pixels wide: the page stays below a few megabytes.
ImageRgb shrunk(ImageRgb image) {
    while (image.width() > 1000) image = downsample_half(image);
    return image;
}

ImageRgb normal_picture(const Relief& relief) {
    ImageRgb picture(relief.mask.width(), relief.mask.height());
    for (std::size_t i = 0; i < picture.size(); ++i)
        if (relief.mask[i] > 127) picture[i] = (0.5f * relief.normals[i].array() + 0.5f).pow(2.2f);
    return picture;
}

/// White balls under the lights, one seen from the front, one from behind.
ImageRgb light_ball(const ViewLights& lights) {
    const int size = 180;
    ImageRgb picture(2 * size, size, Rgb::Constant(0.02f));
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double u = (x + 0.5) / size * 2.2 - 1.1, v = 1.1 - (y + 0.5) / size * 2.2;
            const double rest = 1 - u * u - v * v;
            if (rest <= 0) continue;
            for (int side = 0; side < 2; ++side) {
                const Vec3 n(u, v, side == 0 ? std::sqrt(rest) : -std::sqrt(rest));
                Rgbd e = lights.ambient + lights.from_below * facing_down(n.cast<float>());
                for (const ViewLight& light : lights.lights)
                    e += light.intensity * std::max(0.0, n.dot(light.direction));
                picture(x + side * size, y) = (e / kPi * 0.8).cast<float>();
            }
        }
    }
    return picture;
}

/// Weight of r R_d(r) per channel over r: what each distance contributes.
std::string profile_plot(const MediumEstimate& medium) {
    constexpr int kWidth = 460, kHeight = 220;
    double longest = 0;
    for (const TwoExponentials& fit : medium.fit)
        longest = std::max(longest, 5 * fit.mean_radius());
    if (longest <= 0) return "<p>The material is black.</p>";
    double highest = 0;
    for (int i = 1; i <= 200; ++i)
        for (const TwoExponentials& fit : medium.fit)
            highest = std::max(highest, longest * i / 200 * fit(longest * i / 200));
    std::string svg = fmt::format(
        "<svg viewBox='0 0 {} {}' width='{}' role='img' aria-label='profile'>"
        "<rect width='100%' height='100%' fill='#fff'/>",
        kWidth, kHeight + 24, kWidth);
    const char* const colours[3] = {"#c22", "#283", "#24c"};
    for (std::size_t c = 0; c < 3; ++c) {
        std::string points;
        for (int i = 0; i <= 200; ++i) {
            const double r = longest * i / 200;
            points += fmt::format("{:.1f},{:.1f} ", 1.0 * kWidth * i / 200,
                                  kHeight - 0.95 * kHeight * r * medium.fit[c](r) / highest);
        }
        svg += fmt::format("<polyline fill='none' stroke='{}' stroke-width='2' points='{}'/>",
                           colours[c], points);
    }
    svg += fmt::format(
        "<text x='4' y='{}' font-size='12'>distance from 0 to {:.0f} px ({:.2f} inradii); height: "
        "r R_d(r)</text></svg>",
        kHeight + 16, longest, longest / medium.inradius_px);
    return svg;
}

std::string lights_table(const PhotoAnalysis& analysis) {
    const ViewLights& lights = analysis.lights.lights;
    const double total = std::max(lights.total(), 1e-12);
    std::string html =
        "<table><tr><th>light</th><th>azimuth</th><th>from the view axis</th><th>share</th></tr>";
    for (const ViewLight& light : lights.lights) {
        html += fmt::format(
            "<tr><td>{}</td><td>{:.0f}&deg;</td><td>{:.0f}&deg;</td><td>{:.0f} %</td></tr>",
            light.direction.z() < 0 ? "from behind" : "from the front",
            degrees(std::atan2(light.direction.y(), light.direction.x())),
            degrees(std::acos(std::clamp(light.direction.z(), -1.0, 1.0))),
            100 * luminance(light.intensity) / total);
    }
    html += fmt::format("<tr><td>from the ground</td><td></td><td></td><td>{:.0f} %</td></tr>",
                        100 * 0.5 * luminance(lights.from_below) / total);
    html += fmt::format("<tr><td>from everywhere</td><td></td><td></td><td>{:.0f} %</td></tr>",
                        100 * luminance(lights.ambient) / total);
    return html + "</table>";
}

std::string figure(const fs::path& png, const std::string& caption) {
    return fmt::format(
        "<figure style='display:inline-block;margin:0 1em 1em 0;vertical-align:top'>"
        "<img style='max-width:22em' src='{}' alt='{}'><figcaption>{}</figcaption></figure>",
        png_data_url(png), escape_html(caption), escape_html(caption));
}

/// What the model leaves unexplained of the material photo, four times enlarged around grey.
ImageRgb residual_picture(const LiftedMaterial& source) {
    const ImageRgb& diffuse = source.analysis.highlights.diffuse;
    const Mask& mask = source.analysis.photo.mask;
    ImageRgb picture(mask.width(), mask.height());
    for (std::size_t i = 0; i < picture.size(); ++i) {
        if (mask[i] <= 127) continue;
        for (int c = 0; c < 3; ++c) {
            const float seen =
                linear_to_srgb(static_cast<float>(diffuse[i][c] / source.analysis.white));
            const float left = seen - linear_to_srgb(source.rendered[i][c]);
            picture[i][c] = srgb_to_linear(std::clamp(0.5f + 4 * left, 0.0f, 1.0f));
        }
    }
    return picture;
}

std::string analysis_html(const ScratchFolder& scratch, const std::string& id,
                          const PhotoAnalysis& analysis) {
    const Highlights& highlights = analysis.highlights;
    const char* method = highlights.method == HighlightMethod::Histogram ? "valley of the histogram"
                         : highlights.method == HighlightMethod::TopHat  ? "local top-hat"
                                                                         : "none found";
    std::string html;
    html += figure(scratch.save(id + "_photo", shrunk(analysis.photo.linear), 1 / analysis.white),
                   "photo");
    html += figure(scratch.save(id + "_diffuse", shrunk(highlights.diffuse), 1 / analysis.white),
                   "without its highlights");
    html += figure(scratch.save(id + "_normals", shrunk(normal_picture(analysis.relief))),
                   "shape (normals as colours)");
    html += figure(scratch.save(id + "_ball", light_ball(analysis.lights.lights)),
                   "the lights on a white ball, front and back");
    html += fmt::format(
        "<p>{}Inradius {:.0f} px. Highlights: {:.1f} % of the object ({}). Lighting explained to "
        "{:.0f} %.</p>",
        analysis.relief.is_cluster()
            ? fmt::format("A cluster of {} balls. ", analysis.relief.balls.size())
            : "",
        analysis.relief.inradius_px, 100 * highlights.share, method,
        100 * (1 - std::min(1.0, analysis.explaining.relative_residual)));
    return html + lights_table(analysis);
}

}  // namespace

void write_transfer_report(const fs::path& path, const LiftedMaterial* source,
                           const MediumEstimate& medium, const PhotoAnalysis& target,
                           const TransferPicture& result, const TransferSummary& summary) {
    const ScratchFolder scratch;
    const double shown = 1 / target.white;
    std::string body;
    body += comparison_html("transfer", {"The object in its new material",
                                         scratch.save("before", shrunk(target.photo.linear), shown),
                                         scratch.save("after", shrunk(result.picture), shown)});
    if (!summary.warnings.empty()) {
        body += "<h2>What to watch for</h2><ul>";
        for (const std::string& warning : summary.warnings)
            body += "<li>" + escape_html(warning) + "</li>";
        body += "</ul>";
    }
    body +=
        "<h2>Material</h2><table><tr><th>channel</th><th>reflectance</th><th>mean distance "
        "(px)</th><th>in inradii</th><th>misfit</th><th>outcome</th></tr>";
    const char* const names[3] = {"red", "green", "blue"};
    for (std::size_t c = 0; c < 3; ++c) {
        const ChannelFit& channel = medium.channels[c];
        body += fmt::format(
            "<tr><td>{}</td><td>{:.3f}</td><td>{:.1f}</td><td>{:.3f}</td><td>{:.0f} %</td><td>{} "
            "{}</td></tr>",
            names[c], channel.albedo, channel.mean_radius_px,
            channel.mean_radius_px / medium.inradius_px, 100 * channel.relative_residual,
            outcome_name(channel.outcome), escape_html(channel.reason));
    }
    body += "</table>" + profile_plot(medium);
    if (source != nullptr) {
        body += fmt::format(
            "<p>The surface is taken to let light in {}. The material photo is reproduced at "
            "{:.1f} dB; the best single colour reaches "
            "{:.1f} dB.</p>",
            medium.is_fresnel ? "by Fresnel's law" : "as it falls", source->self_psnr_db,
            source->flat_psnr_db);
        body += figure(scratch.save("self", shrunk(source->rendered)),
                       "the material photo's object, rendered");
        body += figure(scratch.save("residual", shrunk(residual_picture(*source))),
                       "what that leaves unexplained, four times enlarged");
        body += "<h2>Material photo</h2>" + analysis_html(scratch, "source", source->analysis);
    }
    body += "<h2>Object photo</h2>" + analysis_html(scratch, "target", target);
    write_text_file(path, html_page("Vitrine: material transfer", body));
}

}  // namespace vitrine
