#include "runtime/output/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/base64.h"
#include "common/files/image.h"
#include "runtime/output/manifest.h"
#include "runtime/output/run_tables.h"
#include "runtime/output/svg_chart.h"
#include "tests/unit/output/scratch_folder.h"
#include "tests/unit/output/shapes.h"

namespace archetide {
namespace {

void make_run(const std::string& path, const std::string& scene) {
  std::filesystem::create_directories(path + "/pictures");
  Manifest m;
  m.scene = scene;
  m.has_water = true;
  m.exit = 0;
  m.bodies = {{"duck & drake", "tetrahedron", 2.0, 400.0, 0, 300.0}};
  m.phase_seconds = {{"solve", 3.0}, {"advect", 1.0}};
  write_manifest(path + "/manifest.json", m);
  ReducedBody body = rigid_body(tetrahedron_archetype());
  StatsTable stats(path + "/stats.csv");
  BodiesTable bodies(path + "/bodies.csv", {body});
  for (int n = 0; n < 10; ++n) {
    StepReport step;
    step.t = 0.1 * n;
    step.water_volume = 2.0 + 0.001 * n;
    stats.add(step, Profile());
    bodies.add(step.t, 0, body, Vec3::Zero(), Vec3::Zero());
  }
  stats.flush();
  bodies.flush();
  if (png_available()) write_png(path + "/pictures/frame.000003.png", Image(1280, 720));
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; ++at) ++n;
  return n;
}

TEST(Report, IsOneFileThatNeedsNoOther) {
  const ScratchFolder folder;
  make_run(folder / "a", "first <scene>");
  make_run(folder / "b", "second");
  write_report({folder / "a", folder / "b"}, folder / "report.html");
  const std::string html = read_whole_file(folder / "report.html");
  EXPECT_EQ(count(html, "src=\"") - count(html, "src=\"data:"), 0u);
  EXPECT_EQ(count(html, "href="), 0u);
  EXPECT_EQ(count(html, "http"), 0u);
  EXPECT_EQ(count(html, "<img"), png_available() ? 2u : 0u);
  EXPECT_EQ(count(html, "<svg"), count(html, "</svg>"));
  EXPECT_GE(count(html, "<svg"), 2u * 8u);
  EXPECT_EQ(count(html, "nan"), 0u);
  EXPECT_NE(html.find("first &lt;scene&gt;"), std::string::npos);
  EXPECT_NE(html.find("duck &amp; drake"), std::string::npos);
}

TEST(Report, RefusesAFolderThatIsNoRun) {
  const ScratchFolder folder;
  EXPECT_THROW(write_report({folder.path()}, folder / "report.html"), FileError);
  EXPECT_THROW(write_report({}, folder / "report.html"), InputError);
}

TEST(Base64, EncodesTheVectorsOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe"), "//4=");
}

// The y coordinates of a chart's only line.
std::vector<double> drawn_heights(const std::string& svg) {
  std::vector<double> y;
  const std::size_t start = svg.find("<path d=\""), end = svg.find('"', start + 9);
  for (std::size_t at = start; (at = svg.find(' ', at + 1)) < end;)
    if (std::isdigit(svg[at + 1])) y.push_back(std::stod(svg.substr(at + 1)));
  return y;
}

TEST(SvgChart, ThinningALongLineKeepsItsPeaks) {
  Chart chart{"c", "x", "y", {{"s", {}, {}, "#000"}}};
  for (int i = 0; i < 100000; ++i) {
    chart.series[0].x.push_back(i);
    chart.series[0].y.push_back(i == 12345 ? 10.0 : i == 67890 ? -10.0 : 0.0);
  }
  const std::vector<double> y = drawn_heights(svg_chart(chart));
  EXPECT_LT(y.size(), 1100u);
  // The field of the plot reaches from 34 (top) to 220 (bottom).
  EXPECT_EQ(*std::min_element(y.begin(), y.end()), 34.0);
  EXPECT_EQ(*std::max_element(y.begin(), y.end()), 220.0);
}

TEST(SvgChart, ConstantEmptyAndNaNLinesAreDrawable) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::vector<double>& y : {std::vector<double>{},
                                       {1.0, 1.0, 1.0},
                                       {0.0, 0.0, 0.0},
                                       {nan, 1.0, nan},
                                       {nan, nan, nan}}) {
    std::vector<double> x;
    for (std::size_t i = 0; i < y.size(); ++i) x.push_back(0.1 * static_cast<double>(i));
    const std::string svg = svg_chart({"c", "x", "y", {{"s", x, y, "#000"}}});
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
  }
}

TEST(NumberText, IsReadable) {
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(1e300), "1e+300");
  EXPECT_EQ(bytes_text(512), "512 B");
  EXPECT_EQ(bytes_text(1536), "1.50 KiB");
  EXPECT_EQ(bytes_text(3.5 * 1024 * 1024 * 1024), "3.50 GiB");
  EXPECT_EQ(duration_text(42.4), "0:42");
  EXPECT_EQ(duration_text(3 * 3600 + 125), "3:02:05");
  EXPECT_EQ(duration_text(std::numeric_limits<double>::quiet_NaN()), "?");
}

}  // namespace
}  // namespace archetide
