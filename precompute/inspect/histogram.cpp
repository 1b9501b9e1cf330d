#include "precompute/inspect/histogram.h"

#include <algorithm>
#include <cstdio>

#include "common/files/html_text.h"

namespace archetide {
namespace {

constexpr double kWidth = 540, kHeight = 220, kSide = 14, kTop = 34, kBottom = 26;  // SVG units

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

}  // namespace

std::string svg_histogram(const std::string& title, const std::vector<double>& values, double low,
                          double high, int bins) {
  std::vector<int> counts(bins, 0);
  for (const double v : values) {
    const auto bin = static_cast<int>((v - low) / (high - low) * bins);
    ++counts[std::clamp(bin, 0, bins - 1)];
  }
  const int most = std::max(1, *std::max_element(counts.begin(), counts.end()));
  const double step = (kWidth - 2 * kSide) / bins, full = kHeight - kTop - kBottom;
  std::string svg = format("<svg viewBox=\"0 0 %g %g\" role=\"img\">", kWidth, kHeight);
  svg += format("<text x=\"%g\" y=\"18\" font-size=\"13\" font-weight=\"600\">", kSide) +
         html_text(title) + "</text>\n";
  for (int b = 0; b < bins; ++b) {
    // One tet is seen too.
    const double height = counts[b] == 0 ? 0.0 : std::max(1.0, full * counts[b] / most);
    svg += format("<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" fill=\"#2b6ca3\">",
                  kSide + b * step + 0.5, kTop + full - height, step - 1, height) +
           format("<title>%g to %g: %d</title></rect>\n", low + b * (high - low) / bins,
                  low + (b + 1) * (high - low) / bins, counts[b]);
  }
  constexpr int kTicks = 4;
  for (int i = 0; i <= kTicks; ++i) {
    const char* anchor = i == 0 ? "start" : i == kTicks ? "end" : "middle";
    svg += format("<text x=\"%.1f\" y=\"%g\" text-anchor=\"%s\" fill=\"#666\">%g</text>\n",
                  kSide + (kWidth - 2 * kSide) * i / kTicks, kHeight - 8, anchor,
                  low + (high - low) * i / kTicks);
  }
  svg += format(
      "<text x=\"%g\" y=\"18\" text-anchor=\"end\" fill=\"#666\">highest bar %d of %d"
      "</text>",
      kWidth - kSide, most, static_cast<int>(values.size()));
  return svg + "</svg>";
}

}  // namespace archetide
