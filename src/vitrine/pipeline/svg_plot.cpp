#include "pipeline/svg_plot.h"

#include "pipeline/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vitrine {
namespace {
constexpr double kLeft = 58, kRight = 14, kTop = 14, kBottom = 46;
}

std::vector<double> round_ticks(PlotRange range, int wanted) {
    const double span = range.high - range.low;
    if (!(span > 0)) return {range.low};
    const double raw = span / wanted, power = std::pow(10.0, std::floor(std::log10(raw)));
    double step = 10 * power;
    for (const double factor : {1.0, 2.0, 5.0}) {
        if (factor * power >= raw) {
            step = factor * power;
            break;
        }
    }
    std::vector<double> ticks;
    for (double i = std::ceil(range.low / step - 1e-9); i * step <= range.high + 1e-9 * span; ++i) {
        ticks.push_back(i * step + 0.0);
    }
    return ticks;
}

SvgPlot::SvgPlot(std::string x_label, std::string y_label, PlotRange x, PlotRange y, int width,
                 int height)
    : x_label_(std::move(x_label)),
      y_label_(std::move(y_label)),
      x_(x),
      y_(y),
      width_(width),
      height_(height) {}

double SvgPlot::px(double x) const {
    return kLeft + (x - x_.low) / (x_.high - x_.low) * (width_ - kLeft - kRight);
}

double SvgPlot::py(double y) const {
    const double inside = std::clamp((y - y_.low) / (y_.high - y_.low), -0.02, 1.02);
    return height_ - kBottom - inside * (height_ - kTop - kBottom);
}

void SvgPlot::line(const std::vector<PlotPoint>& points, const std::string& style) {
    std::string path;
    bool is_down = false;
    for (const auto& [x, y] : points) {
        if (!std::isfinite(x) || !std::isfinite(y)) {
            is_down = false;
            continue;
        }
        path += fmt::format("{}{:.1f} {:.1f}", is_down ? "L" : "M", px(x), py(y));
        is_down = true;
    }
    body_ += fmt::format("<path d=\"{}\" fill=\"none\" {}/>", path, style);
}

void SvgPlot::dots(const std::vector<PlotPoint>& points, double radius, const std::string& style) {
    for (const auto& [x, y] : points) {
        if (!std::isfinite(x) || !std::isfinite(y)) continue;
        body_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" {}/>", px(x), py(y),
                             radius, style);
    }
}

void SvgPlot::band(const std::vector<PlotPoint>& low, const std::vector<PlotPoint>& high,
                   const std::string& style) {
    std::string points;
    for (const auto& [x, y] : low) points += fmt::format("{:.1f},{:.1f} ", px(x), py(y));
    for (auto p = high.rbegin(); p != high.rend(); ++p) {
        points += fmt::format("{:.1f},{:.1f} ", px((*p)[0]), py((*p)[1]));
    }
    body_ += fmt::format("<polygon points=\"{}\" stroke=\"none\" {}/>", points, style);
}

void SvgPlot::whisker(double x, double low, double high, const std::string& style) {
    body_ += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" {3}/>",
                         px(x), py(std::isfinite(low) ? low : y_.low),
                         py(std::isfinite(high) ? high : y_.high), style);
}

void SvgPlot::label(double x, double y, const std::string& text, const std::string& style) {
    body_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"11\" {}>{}</text>", px(x),
                         py(y), style, escape_html(text));
}

std::string SvgPlot::axes() const {
    std::string text;
    const double bottom = height_ - kBottom, right = width_ - kRight;
    for (const double t : round_ticks(x_, 7)) {
        text += fmt::format(
            "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#8883\"/>"
            "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\" font-size=\"11\">{4:.4g}</text>",
            px(t), kTop, bottom, bottom + 16, t);
    }
    for (const double t : round_ticks(y_, 6)) {
        text += fmt::format(
            "<line x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\" stroke=\"#8883\"/>"
            "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\" font-size=\"11\">{5:.4g}</text>",
            py(t), kLeft, right, kLeft - 6, py(t) + 4, std::abs(t) < 1e-12 ? 0.0 : t);
    }
    text += fmt::format(
        "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#8888\"/>",
        kLeft, kTop, right - kLeft, bottom - kTop);
    text += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                        (kLeft + right) / 2, height_ - 8, escape_html(x_label_));
    text += fmt::format(
        "<text transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        (kTop + bottom) / 2, escape_html(y_label_));
    return text;
}

std::string SvgPlot::svg(const std::string& title) const {
    return fmt::format(
        "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" "
        "style=\"max-width:100%;height:auto\" fill=\"currentColor\" font-size=\"12\" "
        "font-family=\"system-ui,sans-serif\"><title>{2}</title>{3}{4}</svg>",
        width_, height_, escape_html(title), axes(), body_);
}

}  // namespace vitrine
