#include "precompute/inspect/report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "common/archetype/archetype_figures.h"
#include "common/files/atomic_file.h"
#include "common/files/base64.h"
#include "common/files/html_text.h"
#include "precompute/base/build_record.h"
#include "precompute/base/tet_element.h"
#include "precompute/inspect/histogram.h"
#include "precompute/inspect/inspect.h"
#include "precompute/inspect/picture.h"
#include "precompute/meshing/quality.h"

namespace archetide {
namespace {

constexpr int kPictures = 9;  // the rest shape and the first modes
constexpr int kPictureWidth = 360, kPictureHeight = 270;
constexpr double kAmplitude = 0.12;  // largest displacement shown, of the longest side

const char* const kStyle = R"(
body{font:15px/1.5 system-ui,sans-serif;color:#222;background:#f6f7f8;margin:0}
main{max-width:1140px;margin:0 auto;padding:24px}
h1{font-size:24px;margin:0 0 4px}
h2{font-size:20px;margin:40px 0 6px;border-bottom:2px solid #2b6ca3}h3{font-size:16px;margin:22px 0 6px}
p.note{color:#666;margin:2px 0 12px}
.pictures{display:grid;gap:14px;grid-template-columns:repeat(3,1fr)}
.pair{display:grid;gap:14px;grid-template-columns:repeat(2,1fr)}
@media(max-width:760px){.pictures,.pair{grid-template-columns:1fr}}
figure{margin:0;background:#fff;border:1px solid #dde1e5;border-radius:6px;overflow:hidden}
figure img{width:100%;display:block}figcaption{padding:4px 10px;color:#666;font-size:13px}
svg{width:100%;height:auto;display:block;font:11px system-ui,sans-serif}
table{border-collapse:collapse;background:#fff;margin:6px 0 14px;font-variant-numeric:tabular-nums}
td,th{border:1px solid #dde1e5;padding:4px 10px;text-align:right}
td:first-child,th:first-child,.facts td{text-align:left}th{background:#eef1f4;font-weight:600}
)";

struct Subject {
  std::string path;
  Archetype a;
  std::optional<BuildRecord> record;
};

// ---- small pieces of HTML -----------------------------------------------------------------------

std::string number(double x, const char* format = "%.6g") {
  char text[64];
  std::snprintf(text, sizeof text, format, x);
  return text;
}

std::string signed_percent(double x, double reference) {
  return reference == 0 ? "" : number(100 * (x / reference - 1), "%+.3g %%");
}

std::string triple(const Vec3& x, const char* format = "%.5g") {
  return number(x[0], format) + ", " + number(x[1], format) + ", " + number(x[2], format);
}

std::string row(const std::vector<std::string>& cells, const char* tag = "td") {
  std::string html = "<tr>";
  for (const std::string& cell : cells)
    html += std::string("<") + tag + ">" + cell + "</" + tag + ">";
  return html + "</tr>\n";
}

// ---- sections -----------------------------------------------------------------------------------

std::string facts(const Subject& s) {
  const Archetype& a = s.a;
  const auto line = [](const std::string& name, const std::string& value) {
    return row({name, html_text(value)});
  };
  return "<table class=\"facts\">" + line("file", s.path) +
         line("made by", a.generator + ", " + a.blas) +
         line("mesh", a.mesh_file + ", mesher " + a.mesher + ", " + a.mass_kind + " mass") +
         line("tets", fmt::format("{} with {} nodes; surface of {} vertices, {} triangles",
                                  a.tets.tets.size(), a.tets.nodes.size(),
                                  a.surface.vertices.size(), a.surface.triangles.size())) +
         line("material", number(a.density) + " kg/m^3, Young " + number(a.young) +
                              " Pa, Poisson " + number(a.poisson) + ", damping " + number(a.alpha) +
                              " 1/s, " + number(a.beta) + " s") +
         line("content hash", a.content_hash) +
         line("bytes", std::to_string(std::filesystem::file_size(s.path))) + "</table>\n";
}

/// The sums over the tets against the surface of the archetype and the surface that came in.
std::string mass_properties(const Subject& s) {
  const Archetype& a = s.a;
  const SolidFigures solid = solid_of_surface(a);
  const bool input = s.record && s.record->surface_volume > 0;
  const Vec3 tets = principal_moments(inertia(a)), exact = principal_moments(solid.inertia);
  const double size = longest_side(a);
  const auto line = [&](const std::string& name, double value, double of_surface, double of_input) {
    std::vector<std::string> cells = {name, number(value), number(of_surface),
                                      signed_percent(value, of_surface)};
    if (input) cells.insert(cells.end(), {number(of_input), signed_percent(value, of_input)});
    return row(cells);
  };
  std::vector<std::string> head = {"", "archetype", "its surface, exact", "difference"};
  if (input) head.insert(head.end(), {"input surface, exact", "difference"});
  const double volume = input ? s.record->surface_volume : 0.0;
  const Vec3 in =
      input ? Vec3(principal_moments(a.density * s.record->surface_inertia)) : Vec3(Vec3::Zero());
  std::string html = "<table>" + row(head, "th") +
                     line("volume, m^3", a.volume, solid.mass / a.density, volume) +
                     line("mass, kg", a.integrals.mass, solid.mass, a.density * volume);
  for (int i = 0; i < 3; ++i)
    html += line(fmt::format("principal moment {}, kg m^2", i + 1), tets[i], exact[i], in[i]);
  std::vector<std::string> cells = {"centre, m", triple(a.centre), triple(a.centre + solid.centre),
                                    number(solid.centre.norm() / size, "%.2g of the size")};
  if (input)
    cells.insert(cells.end(), {triple(s.record->surface_centroid),
                               number((s.record->surface_centroid - a.centre).norm() / size,
                                      "%.2g of the size")});
  return html + row(cells) + "</table>\n";
}

/// Smallest Jacobian of each tet that is not straight, in units of the straight tet's.
std::vector<double> curved_jacobians(const TetMesh& tets) {
  std::vector<double> list;
  for (int t = 0; t < int(tets.tets.size()); ++t) {
    const auto x = element_positions<10>(tets, element_nodes<10>(tets, t));
    if (!is_straight(x)) list.push_back(smallest_jacobian(x));
  }
  return list;
}

std::string quality(const Archetype& a) {
  std::vector<double> angles, ratios;
  for (const TetMeasure& shape : tet_measures(a.tets)) {
    angles.push_back(shape.min_dihedral);
    ratios.push_back(shape.radius_ratio);
  }
  const bool curved = a.tets.order() == 2;
  const QualityLimits limits;
  return "<p class=\"note\">Worst: smallest dihedral angle " + number(a.min_dihedral, "%.2f") +
         " degrees (limit " + number(limits.min_dihedral) + "), radius ratio " +
         number(a.min_radius_ratio, "%.3f") + " (limit " + number(limits.min_radius_ratio) +
         ").</p>\n<div class=\"pair\"><figure>" +
         svg_histogram("Smallest dihedral angle of each tet, degrees", angles, 0, 72, 24) +
         "</figure><figure>" +
         svg_histogram("Radius ratio of each tet (1: regular)", ratios, 0, 1, 20) + "</figure>" +
         (curved ? "<figure>" +
                       svg_histogram("Smallest Jacobian of each curved tet (1: straight)",
                                     curved_jacobians(a.tets), 0, 1, 20) +
                       "</figure>"
                 : "") +
         "</div>\n" +
         (curved ? "<p class=\"note\">Angles and ratios are those of the straight tets between "
                   "the corners; tets with straight edges are left out of the third.</p>\n"
                 : "");
}

std::string modes_table(const Archetype& a) {
  const Orthogonality o = orthogonality(a);
  const std::vector<double> hz = frequencies_hz(a);
  std::string html =
      "<table>" + row({"vector", "kind", "frequency, Hz", "estimated error, %", "residual"}, "th");
  for (int k = 0; k < a.r(); ++k) {
    const std::optional<double> error = frequency_error(a, k);
    html += row({std::to_string(k + 1), kind_of(a, k), number(hz[k]),
                 error ? number(100 * *error, "%+.2g") : "",
                 a.is_static[k] ? "" : number(a.residuals[k], "%.1e")});
  }
  return html +
         "</table>\n<p class=\"note\">A static vector answers a load; its frequency is that of its "
         "energy. Estimated error: from a mesh of a quarter of the tets. Residual |K &phi; &minus; "
         "&omega;&sup2; M &phi;| / |K "
         "&phi;|. Orthogonality: modes with each other " +
         number(o.mass, "%.1e") + " kg, with translations " + number(o.translation, "%.1e") +
         ", with rotations " + number(o.rotation, "%.1e") + ".</p>\n";
}

/// The surface displaced by mode k (from 0; -1: at rest), and how far each vertex moves, m.
TriMesh displaced(const Archetype& a, int k, double largest, std::vector<double>& moved) {
  TriMesh shape = a.surface;
  moved.assign(shape.vertices.size(), 0.0);
  if (k < 0) return shape;
  const VecX phi = a.surface_modes.col(k);
  const double scale = largest / phi.reshaped(3, phi.size() / 3).colwise().norm().maxCoeff();
  for (std::size_t v = 0; v < moved.size(); ++v) {
    const Vec3 u = scale * phi.segment<3>(3 * static_cast<Eigen::Index>(v));
    shape.vertices[v] += u;
    moved[v] = u.norm();
  }
  return shape;
}

std::string picture(const Archetype& a, int k) {
  const double largest = kAmplitude * longest_side(a);
  std::vector<double> moved;
  const TriMesh shape = displaced(a, k, largest, moved);
  for (double& u : moved) u = k < 0 ? 0.35 : u / largest;
  return "<figure><img alt=\"\" src=\"data:image/png;base64," +
         base64(png_bytes(draw_surface(shape, moved, a.surface.vertices, 0.5 * largest,
                                       kPictureWidth, kPictureHeight))) +
         "\"/><figcaption>" +
         (k < 0 ? "at rest"
                : fmt::format("{}{}, {} Hz", a.is_static[k] ? "static vector " : "mode ", k + 1,
                              number(frequencies_hz(a)[k], "%.4g"))) +
         "</figcaption></figure>\n";
}

std::string pictures(const Archetype& a) {
  if (!png_available()) return "<p class=\"note\">No pictures: built without libpng.</p>\n";
  std::string html = "<p class=\"note\">Displaced by " + number(100 * kAmplitude) +
                     " % of the longest side where it moves most (yellow).</p>\n"
                     "<div class=\"pictures\">\n";
  for (int k = -1; k < std::min(a.r(), kPictures - 1); ++k) html += picture(a, k);
  return html + "</div>\n";
}

std::string making(const Subject& s) {
  if (!s.record)
    return "<p class=\"note\">Not recorded: there is no " +
           html_text(beside(s.path, ".build.json")) + " for this content.</p>\n";
  std::string html;
  for (const std::string& note : s.record->notes)
    html += "<p class=\"note\">Intake: " + html_text(note) + "</p>\n";
  std::vector<std::string> head = {"phase"}, cells = {"seconds"};
  double total = 0.0;
  for (const auto& [phase, seconds] : s.record->seconds) {
    head.push_back(html_text(phase));
    cells.push_back(number(seconds, "%.2f"));
    total += seconds;
  }
  head.push_back("all"), cells.push_back(number(total, "%.2f"));
  html += "<table>" + row(head, "th") + row(cells) + "</table>\n";
  head = {"after"}, cells = {"peak memory, MB"};
  for (const auto& [step, bytes] : s.record->memory) {
    head.push_back(html_text(step));
    cells.push_back(number(bytes / 1e6, "%.0f"));
  }
  return html + "<table>" + row(head, "th") + row(cells) + "</table>\n";
}

std::string section(const Subject& s) {
  const Archetype& a = s.a;
  return "<h2>" + html_text(a.name) + "</h2>\n" + facts(s) + "<h3>Mass and inertia</h3>\n" +
         mass_properties(s) + "<h3>Quality of the tets</h3>\n" + quality(a) + "<h3>Modes</h3>\n" +
         modes_table(a) + pictures(a) + "<h3>Making</h3>\n" + making(s);
}

}  // namespace

void write_archetype_report(const std::string& path, const std::vector<std::string>& archetypes) {
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>archetypes</title><style>" +
      std::string(kStyle) + "</style></head><body><main>\n<h1>Body archetypes</h1>\n";
  for (const std::string& file : archetypes) {
    Subject s{file, read_archetype(file), {}};
    s.record = read_record(file, s.a.content_hash);
    html += section(s);
  }
  write_file_atomically(path, html + "</main></body></html>\n");
}

}  // namespace archetide
