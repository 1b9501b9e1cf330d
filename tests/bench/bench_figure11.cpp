// Fig. 11 from its four runs (tests/bench/figure11/run_figure11.sh): seconds, iterations and memory a frame of rings with
// 10 modes and with every node, of 5k and 60k tets, and what the modes cost in error.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/files/text_csv.h"
#include "runtime/output/csv.h"
#include "runtime/output/report_parts.h"
#include "runtime/output/svg_chart.h"
#include "runtime/output/vtp.h"
#include "tests/bench/frame_costs.h"

namespace archetide {
namespace {

constexpr const char* kMeshes[] = {"5k", "60k"};
constexpr const char* kKinds[] = {"modes", "deformable"};

struct Pose {
  Vec3 position = Vec3::Zero();  // m
  Quat rotation = Quat::Identity();
};

/// One run, frame by frame; frame 0 is the start.
struct Run {
  std::string name;
  std::vector<double> seconds, iterations, mebibytes;
  std::vector<std::vector<Pose>> poses;                // of each ring
  std::vector<std::vector<std::vector<Vec3>>> points;  // of each ring's surface, m
};

// The most that was seen up to each frame.
void read_memory(const std::string& path, Run& run) {
  constexpr double kKibibytes = 1.0 / 1024.0;
  run.mebibytes.assign(run.seconds.size(), 0.0);
  std::ifstream file(path);
  double frames = 0.0, kibibytes = 0.0;
  char comma = 0;
  while (file >> frames >> comma >> kibibytes)
    for (std::size_t f = static_cast<std::size_t>(std::max(0.0, frames)); f < run.mebibytes.size();
         ++f)
      run.mebibytes[f] = std::max(run.mebibytes[f], kKibibytes * kibibytes);
}

Run read_run(const std::string& out, const std::string& name) {
  Run run;
  run.name = name;
  const std::string folder = out + "/" + name;
  const CsvTable bodies = read_csv(folder + "/bodies.csv");
  const std::vector<double>& t = column_of(bodies, "t");
  std::vector<double> times;
  for (std::size_t n = 0; n < t.size(); ++n) {
    if (times.empty() || t[n] > times.back()) times.push_back(t[n]), run.poses.emplace_back();
    const auto at = [&](const char* key) { return column_of(bodies, key)[n]; };
    run.poses.back().push_back(
        {Vec3(at("x"), at("y"), at("z")), Quat(at("qw"), at("qx"), at("qy"), at("qz"))});
  }
  for (std::size_t f = 0; f < times.size(); ++f) {
    char file[64];
    std::snprintf(file, sizeof file, "/frames/bodies.%06zu.vtp", f);
    const SurfaceMesh mesh = read_vtp(folder + file);
    std::vector<std::vector<Vec3>> rings(run.poses[f].size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      rings.at(static_cast<std::size_t>(mesh.body.at(v))).push_back(mesh.vertices[v]);
    run.points.push_back(std::move(rings));
  }
  FrameCosts costs = frame_costs(read_csv(folder + "/stats.csv"), times);
  run.seconds = std::move(costs.seconds), run.iterations = std::move(costs.iterations);
  read_memory(out + "/" + name + ".memory", run);
  return run;
}

/// What a run with modes differs in from that with every node, root mean squares over rings, m.
struct Errors {
  std::vector<double> path, shape;  // of the centre of mass; of the surface, seen from the body
};

Errors errors_of(const Run& modes, const Run& full) {
  Errors e;
  for (std::size_t f = 0; f < std::min(modes.poses.size(), full.poses.size()); ++f) {
    double path = 0.0, shape = 0.0;
    const std::size_t rings = modes.poses[f].size();
    for (std::size_t b = 0; b < rings; ++b) {
      const Pose &p = modes.poses[f][b], &q = full.poses[f][b];
      path += (p.position - q.position).squaredNorm();
      const std::vector<Vec3>&x = modes.points[f][b], &y = full.points[f][b];
      double sum = 0.0;
      for (std::size_t v = 0; v < x.size(); ++v)
        sum += (p.rotation.conjugate() * (x[v] - p.position) -
                q.rotation.conjugate() * (y[v] - q.position))
                   .squaredNorm();
      shape += sum / static_cast<double>(x.size());
    }
    e.path.push_back(std::sqrt(path / static_cast<double>(rings)));
    e.shape.push_back(std::sqrt(shape / static_cast<double>(rings)));
  }
  return e;
}

double total(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v) sum += x;
  return sum;
}

class Page {
 public:
  void add(const std::string& title, const std::string& unit,
           const std::vector<std::pair<std::string, const std::vector<double>*>>& curves) {
    Chart chart{title, "frame", unit, {}};
    for (const auto& [name, values] : curves) {
      Series series{name, {}, *values, chart_colour(static_cast<int>(chart.series.size()))};
      for (std::size_t f = 0; f < values->size(); ++f) series.x.push_back(static_cast<double>(f));
      chart.series.push_back(std::move(series));
      columns_.emplace_back(title + " " + name, values);
    }
    html_ += svg_chart(chart);
  }
  void write(const std::string& out) const {
    std::ofstream(out + "/figure11.html")
        << html_page("Figure 11: rings with modes and with every node",
                     "<div class=\"charts\">\n" + html_ + "</div>\n");
    TextTable table;
    table.names.push_back("frame");
    std::size_t frames = 0;
    for (const auto& [name, values] : columns_)
      table.names.push_back(name), frames = std::max(frames, values->size());
    for (std::size_t f = 0; f < frames; ++f) {
      table.rows.push_back({std::to_string(f)});
      for (const auto& [name, values] : columns_)
        table.rows.back().push_back(f < values->size() ? cell_text((*values)[f]) : "");
    }
    write_text_csv(out + "/figure11.csv", table);
  }

 private:
  std::string html_;
  std::vector<std::pair<std::string, const std::vector<double>*>> columns_;
};

void compare(const std::string& out) {
  std::vector<Run> runs;
  for (const char* mesh : kMeshes)
    for (const char* kind : kKinds) runs.push_back(read_run(out, std::string(kind) + mesh));
  std::printf("%-14s %10s %12s %10s\n", "run", "seconds", "iterations", "MiB");
  for (const Run& run : runs)
    std::printf("%-14s %10.1f %12.1f %10.0f\n", run.name.c_str(), total(run.seconds),
                total(run.iterations) / static_cast<double>(run.iterations.size() - 1),
                run.mebibytes.back());
  const Errors coarse = errors_of(runs[0], runs[1]), fine = errors_of(runs[2], runs[3]);
  for (const auto& [mesh, e] : {std::pair("5k", &coarse), std::pair("60k", &fine)})
    std::printf(
        "%s: modes are off by %.2g m of path and %.2g m of shape in the end, at most %.2g and %.2g "
        "m\n",
        mesh, e->path.back(), e->shape.back(), *std::max_element(e->path.begin(), e->path.end()),
        *std::max_element(e->shape.begin(), e->shape.end()));
  Page page;
  const auto all = [&](std::vector<double> Run::*member) {
    std::vector<std::pair<std::string, const std::vector<double>*>> curves;
    for (const Run& run : runs) curves.emplace_back(run.name, &(run.*member));
    return curves;
  };
  page.add("seconds", "s", all(&Run::seconds));
  page.add("iterations", "of a solve", all(&Run::iterations));
  page.add("memory", "MiB", all(&Run::mebibytes));
  page.add("error of the path", "m", {{"5k", &coarse.path}, {"60k", &fine.path}});
  page.add("error of the shape", "m", {{"5k", &coarse.shape}, {"60k", &fine.shape}});
  page.write(out);
  std::printf("figure11: open %s/figure11.html\n", out.c_str());
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: bench_figure11 FOLDER of the four runs\n");
    return 2;
  }
  archetide::compare(argv[1]);
}
