// Coupling: what obstacles, bodies and skins leave open of cells and faces, and the flux of their
// surfaces.

#include <utility>

#include "runtime/coupling/coupling.h"
#include "runtime/numerics/parallel.h"

namespace archetide {

void Coupling::set_tank(const Grid& g, const Sides& open_side) {
  options_.grid = g;
  options_.open_side = open_side;
  if (g.cells() == 0) return;  // no tank: nothing to couple
  obstacle_faces_.clear();
  obstacles_.face.resize(g, 0.0);
  obstacles_.cell.resize(g.nx, g.ny, g.nz, 0.0);
  obstacles_.moments.clear();
  for (const TriMesh& m : obstacle_surfaces_) {
    if (options_.geometry == Geometry::kCutCell) {
      obstacle_faces_.push_back(add_solid_fractions(g, m.vertices, m.triangles, obstacles_));
    } else
      add_voxel_fractions(cells_inside(g, m.vertices, m.triangles), obstacles_);
  }
  obstacle_walls_ = wall_faces(obstacles_);
  open_.resize(g, 1.0);
  solids_ = obstacles_;
  cut_.clear();
  open_box(whole_box(g));
  valid_.set_layers(g.nz, 0);
  for (auto& p : pressure_) p.set_layers(g.nz, 0.0);
}

// What solids leave open of the faces in a box.
void Coupling::open_box(const CellBox& box) {
  for (int a = 0; a < 3; ++a) {
    const double* solid = solids_.face[a].data();
    double* open = open_[a].data();
    for_each_row(open_[a], box, [&](std::size_t first, std::size_t last) {
#pragma omp simd
      for (std::size_t n = first; n < last; ++n) {
        const double w = 1.0 - solid[n];
        open[n] = w < kSliver ? 0.0 : w > 1.0 ? 1.0 : w;
      }
    });
  }
  changed_.push_back(box);
}

// Bodies cut few of the cells: the others stay as the obstacles leave them.
void Coupling::forget_bodies() {
  for (const CellBox& box : cut_) {
    copy_box(obstacles_.face, box, solids_.face);
    copy_box(obstacles_.cell, box, solids_.cell);
  }
  solids_.moments = obstacles_.moments;
}

// Bodies that the water meets themselves: fractions, fluxes and dual faces of each.
void Coupling::cut_bare_bodies() {
  const Grid& g = options_.grid;
  std::vector<std::size_t> bare;
  std::vector<const BodySurface*> bare_surfaces;
  std::vector<DualFaces*> bare_faces;
  for (std::size_t n = 0; n < surfaces_.size(); ++n) {
    if (skinned_[n]) continue;
    cut_.push_back(cell_box(g, surfaces_[n].points));
    bare.push_back(n), bare_surfaces.push_back(&surfaces_[n]), bare_faces.push_back(&faces_[n]);
    if (options_.geometry == Geometry::kVoxel)
      voxels_.push_back(voxel_body(g, surfaces_[n], solids_));
  }
  if (options_.geometry == Geometry::kVoxel) return;
  std::vector<BodyFlux> fluxes = cut_bodies(g, bare_surfaces, bare_faces, solids_);
  for (std::size_t m = 0; m < bare.size(); ++m) fluxes_[bare[m]] = std::move(fluxes[m]);
}

// Skins, met instead of their members (Section 7).
void Coupling::cut_skins() {
  const Grid& g = options_.grid;
  skin_points_.resize(skins_.size());
  for (std::size_t s = 0; s < skins_.size(); ++s) {
    const auto body_of = [&](int b) -> const ReducedBody& { return *surfaces_[b].body; };
    skin_points(skins_[s], skins_[s].wet_shape(), body_of, skin_points_[s]);
    cut_.push_back(cell_box(g, skin_points_[s]));
    std::vector<BodyFlux> of_members =
        cut_skin(g, wet_surface(skins_[s], surfaces_, skin_points_[s]), solids_);
    for (std::size_t m = 0; m < of_members.size(); ++m)
      fluxes_[skins_[s].bodies[m]] = std::move(of_members[m]);
  }
}

void Coupling::update_geometry(const std::vector<StageBody>& bodies) {
  forget_bodies();
  const std::vector<CellBox> before = std::exchange(cut_, {});
  surfaces_.clear();
  voxels_.clear();
  faces_.resize(bodies.size());
  fluxes_.assign(bodies.size(), {});
  skinned_ = skinned_bodies(bodies.size(), skins_);
  surfaces_.resize(bodies.size());
  for_each_large(bodies.size(), [&](std::size_t b) {
    surfaces_[b] =
        body_surface(bodies[b].met ? *bodies[b].met : *bodies[b].body, options_.modal.mass);
  });
  cut_bare_bodies();
  cut_skins();
  for (const CellBox& box : before) open_box(box);
  for (const CellBox& box : cut_) open_box(box);
  close_sides(options_.grid, options_.open_side, open_);
}

void Coupling::prepare_geometry(const std::vector<StageBody>& bodies) {
  if (!wet()) return;
  update_geometry(bodies);
  known_ = Known::kGeometry;
}

}  // namespace archetide
