// pipeline/svg_plot.h: small line plots as SVG text, for our HTML reports. No script, no outside
// file; colours follow the page's light or dark scheme.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace vitrine {

using PlotPoint = std::array<double, 2>;

struct PlotRange {
    double low = 0, high = 1;
};

class SvgPlot {
  public:
    SvgPlot(std::string x_label, std::string y_label, PlotRange x, PlotRange y, int width = 520,
            int height = 340);

    /// Points that are not finite break the line.
    /// @param style SVG attributes, e.g. `stroke="#2a7fb8" stroke-width="2"`
    void line(const std::vector<PlotPoint>& points, const std::string& style);
    void dots(const std::vector<PlotPoint>& points, double radius, const std::string& style);
    void band(const std::vector<PlotPoint>& low, const std::vector<PlotPoint>& high,
              const std::string& style);
    /// Vertical whisker from low to high; an infinite end is drawn to the border.
    void whisker(double x, double low, double high, const std::string& style);
    void label(double x, double y, const std::string& text, const std::string& style = "");
    std::string svg(const std::string& title) const;

  private:
    double px(double x) const;
    double py(double y) const;
    std::string axes() const;

    std::string x_label_, y_label_;
    PlotRange x_, y_;
    int width_, height_;
    std::string body_;
};

/// About `wanted` round numbers within the range.
std::vector<double> round_ticks(PlotRange range, int wanted);

}  // namespace vitrine
