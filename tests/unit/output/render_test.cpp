#include "runtime/output/render.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/image.h"
#include "runtime/output/camera.h"
#include "runtime/output/manifest.h"
#include "runtime/output/ply.h"
#include "runtime/output/vtp.h"
#include "runtime/output/water_surface.h"
#include "tests/unit/output/scratch_folder.h"
#include "tests/unit/output/shapes.h"

namespace archetide {
namespace {

// A run of two frames: a unit tank, water to 0.4 m, an orange ball (body 0) over it and a green one
// (body 2) in it.
class RenderedRun : public testing::Test {
 protected:
  void SetUp() override {
    if (!render_available()) GTEST_SKIP() << "this build has no embree or no libpng";
    std::filesystem::create_directories(folder_ / "frames");
    Manifest m;
    Grid& g = m.grid;
    g.nx = g.ny = g.nz = 16, g.dx = 1.0 / 16;
    write_manifest(folder_ / "manifest.json", m);
    Array3<double> phi(16, 16, 16);
    for (int k = 0; k < 16; ++k)
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 16; ++i) phi(i, j, k) = g.cell_centre(i, j, k)[2] - 0.4;
    write_ply(folder_ / "frames/surface.000000.ply", water_surface(g, phi));
    write_ply(folder_ / "frames/surface.000001.ply", water_surface(g, phi));
    SurfaceMesh balls = ball(Vec3(0.5, 0.5, 0.75), 0.15, 0);
    write_vtp(folder_ / "frames/bodies.000000.vtp", balls, 0.0);
    write_vtp(folder_ / "frames/bodies.000001.vtp", ball(Vec3(0.5, 0.2, 0.2), 0.15, 2), 1.0 / 24);
    options_.width = 96, options_.height = 64;
    options_.azimuth = 0.0, options_.elevation = 5.0;
    options_.film = false, options_.quiet = true;
  }

  // Red, green and blue of the pixel where a point of the tank appears.
  Vec3 pixel_at(const Image& image, const Vec3& x) const {
    const Camera camera(Vec3::Zero(), Vec3::Ones(), options_.azimuth, options_.elevation,
                        image.width, image.height);
    const Vec3f wanted = (x - camera.eye()).normalized().cast<float>();
    int best = 0;
    float closest = -1.0f;
    for (int p = 0; p < image.width * image.height; ++p) {
      const float c =
          camera.ray(p % image.width + 0.5, p / image.width + 0.5).direction.dot(wanted);
      if (c > closest) closest = c, best = p;
    }
    return Vec3(image.rgb[3 * best], image.rgb[3 * best + 1], image.rgb[3 * best + 2]);
  }

  ScratchFolder folder_;
  RenderOptions options_;
};

TEST_F(RenderedRun, BodiesKeepTheirColourInAirAndBehindWater) {
  const RenderSummary summary = render_run(folder_.path(), options_);
  EXPECT_EQ(summary.frames, 2);
  const Vec3 orange =
      pixel_at(read_png(folder_ / "pictures/frame.000000.png"), Vec3(0.5, 0.5, 0.75));
  EXPECT_GT(orange[0], 1.5 * orange[1]);
  EXPECT_GT(orange[0], 1.5 * orange[2]);
  const Vec3 green = pixel_at(read_png(folder_ / "pictures/frame.000001.png"), Vec3(0.5, 0.2, 0.2));
  EXPECT_GT(green[1], 1.1 * green[0]);
  EXPECT_GT(green[1], 1.1 * green[2]);
}

TEST_F(RenderedRun, MarkersAreWarmDotsInTheWater) {
  std::vector<Vec3> cloud;  // a sheet behind the front pane, a dot every radius or so
  for (int n = 0; n < 900; ++n)
    cloud.emplace_back(0.15 + 0.003 * (n % 30), 0.01, 0.1 + 0.003 * (n / 30));
  write_markers_vtp(folder_ / "frames/markers.000000.vtp", cloud, cloud, 0.0);
  render_run(folder_.path(), options_);
  const Vec3 at(0.195, 0.01, 0.145);  // water and floor behind it in both frames
  const Vec3 with = pixel_at(read_png(folder_ / "pictures/frame.000000.png"), at);
  const Vec3 without = pixel_at(read_png(folder_ / "pictures/frame.000001.png"), at);
  EXPECT_GT(with[0] - with[2], without[0] - without[2] + 40.0);  // red less blue, of 255
}

TEST_F(RenderedRun, WaterIsBluerThanTheGroundBesideIt) {
  render_run(folder_.path(), options_);
  const Image image = read_png(folder_ / "pictures/frame.000000.png");
  const Vec3 water = pixel_at(image, Vec3(0.5, 0.0, 0.2)),
             ground = pixel_at(image, Vec3(1.5, 0, 0));
  EXPECT_GT(water[2] - water[0], ground[2] - ground[0] + 40.0);
}

TEST_F(RenderedRun, SamePictureEveryTime) {
  options_.last_frame = 0;
  render_run(folder_.path(), options_);
  const std::string first = read_whole_file(folder_ / "pictures/frame.000000.png");
  render_run(folder_.path(), options_);
  EXPECT_EQ(read_whole_file(folder_ / "pictures/frame.000000.png"), first);
}

// Beside the tables, where the README says; half a film never.
TEST_F(RenderedRun, TheFilmLiesInTheRunFolder) {
  options_.film = true;
  const std::string film = render_run(folder_.path(), options_).film;
  if (film.empty()) GTEST_SKIP() << "no ffmpeg";
  EXPECT_EQ(std::filesystem::path(film), std::filesystem::path(folder_ / "film.mp4"));
  EXPECT_GT(std::filesystem::file_size(folder_ / "film.mp4"), 0u);
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "pictures"))
    EXPECT_EQ(file.path().extension(), ".png");
}

TEST_F(RenderedRun, OnlyTheChosenFramesAreDrawn) {
  options_.first_frame = options_.last_frame = 1;
  EXPECT_EQ(render_run(folder_.path(), options_).frames, 1);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "pictures/frame.000000.png"));
  options_.first_frame = options_.last_frame = 7;
  EXPECT_THROW(render_run(folder_.path(), options_), FileError);
}

TEST_F(RenderedRun, BadOptionsAreRefused) {
  options_.width = 0;
  EXPECT_THROW(render_run(folder_.path(), options_), InputError);
}

TEST(Render, AFolderThatIsNoRunIsRefused) {
  if (!render_available()) GTEST_SKIP() << "this build has no embree or no libpng";
  const ScratchFolder folder;
  EXPECT_THROW(render_run(folder.path(), RenderOptions()), FileError);
  EXPECT_THROW(render_run(folder / "missing", RenderOptions()), FileError);
}

TEST(Camera, HoldsTheWholeBoxTightlyFromAnywhere) {
  const Vec3 low(-1, 0, 2), high(0.5, 4, 7);
  for (const double azimuth : {-60.0, 0.0, 25.0, 140.0})
    for (const double elevation : {-20.0, 5.0, 60.0}) {
      const int width = 320, height = 200;
      const Camera camera(low, high, azimuth, elevation, width, height);
      // Projects a corner by means of the rays through the picture's middle and its edges.
      const Vec3 forward = camera.ray(width / 2.0, height / 2.0).direction.cast<double>();
      const Vec3 right_edge = camera.ray(width, height / 2.0).direction.cast<double>();
      const Vec3 top_edge = camera.ray(width / 2.0, 0).direction.cast<double>();
      const Vec3 right = right_edge / right_edge.dot(forward) - forward;
      const Vec3 up = top_edge / top_edge.dot(forward) - forward;
      double farthest = 0.0;
      for (int c = 0; c < 8; ++c) {
        const Vec3 x =
            Vec3((c & 1 ? high : low)[0], (c & 2 ? high : low)[1], (c & 4 ? high : low)[2]) -
            camera.eye();
        const double depth = x.dot(forward);
        ASSERT_GT(depth, 0.0);
        farthest = std::max({farthest, std::abs(x.dot(right)) / right.squaredNorm() / depth,
                             std::abs(x.dot(up)) / up.squaredNorm() / depth});
      }
      EXPECT_LE(farthest, 1.0 / 1.06 + 1e-5);  // the margin of 6 %; measured 0.9434
      EXPECT_GE(farthest, 0.94);
    }
}

TEST(Image, PngReadsBackTheSamePixels) {
  if (!png_available()) GTEST_SKIP() << "this build has no libpng";
  const ScratchFolder folder;
  Image image(7, 5);
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = static_cast<std::uint8_t>(37 * i);
  write_png(folder / "a.png", image);
  const Image back = read_png(folder / "a.png");
  EXPECT_EQ(back.width, 7);
  EXPECT_EQ(back.height, 5);
  EXPECT_EQ(back.rgb, image.rgb);
}

TEST(Image, ShrinkingTakesTheMeanOfEachBox) {
  Image image(4, 2);
  for (int p = 0; p < 8; ++p) image.rgb[3 * p] = static_cast<std::uint8_t>(10 * p);
  const Image small = shrunk(image, 2);
  ASSERT_EQ(small.width, 2);
  ASSERT_EQ(small.height, 1);
  EXPECT_EQ(small.rgb[0], (0 + 10 + 40 + 50) / 4);
  EXPECT_EQ(small.rgb[3], (20 + 30 + 60 + 70) / 4);
}

}  // namespace
}  // namespace archetide
