#include "tests/bench/pfmg.h"

#include <HYPRE.h>
#include <HYPRE_struct_ls.h>
#include <mpi.h>

#include <algorithm>
#include <vector>

namespace archetide {
namespace {

bool unknown(const PoissonMatrix& a, int i, int j, int k) {
  return a.kind.contains(i, j, k) && a.kind(i, j, k) == CellKind::kUnknown;
}

// MPI and hypre, once a process.
void start_hypre() {
  static const bool started = [] {
    int already = 0;
    MPI_Initialized(&already);
    if (!already) {
      MPI_Init(nullptr, nullptr);
      std::atexit([] { MPI_Finalize(); });
    }
    HYPRE_Init();
    return true;
  }();
  (void)started;
}

}  // namespace

struct Pfmg::Impl {
  HYPRE_Int low[3], high[3];  // the box around the unknowns, inclusive
  std::size_t nx, ny;         // of the whole grid
  HYPRE_StructGrid grid;
  HYPRE_StructStencil stencil;
  HYPRE_StructMatrix A;
  HYPRE_StructVector r, z;
  HYPRE_StructSolver cycle;
  std::vector<double> box;

  explicit Impl(const PoissonMatrix& a);
  ~Impl();
  void fill(const PoissonMatrix& a);
  // f(entry of the box, entry of the grid) row by row
  template <class F>
  void for_cells(F&& f) const {
    std::size_t n = 0;
    for (HYPRE_Int k = low[2]; k <= high[2]; ++k)
      for (HYPRE_Int j = low[1]; j <= high[1]; ++j) {
        const std::size_t row = nx * (j + ny * static_cast<std::size_t>(k));
        for (HYPRE_Int i = low[0]; i <= high[0]; ++i) f(n++, row + i);
      }
  }
};

Pfmg::Impl::Impl(const PoissonMatrix& a) : nx(a.nx), ny(a.ny) {
  start_hypre();
  const HYPRE_Int size[3] = {a.nx, a.ny, a.nz};
  std::copy(size, size + 3, low);
  std::fill(high, high + 3, 0);
  for (int k = 0; k < a.nz; ++k)
    for (int j = 0; j < a.ny; ++j)
      for (int i = 0; i < a.nx; ++i) {
        if (!unknown(a, i, j, k)) continue;
        const HYPRE_Int c[3] = {i, j, k};
        for (int d = 0; d < 3; ++d)
          low[d] = std::min(low[d], c[d]), high[d] = std::max(high[d], c[d]);
      }
  HYPRE_StructGridCreate(MPI_COMM_SELF, 3, &grid);
  HYPRE_StructGridSetExtents(grid, low, high);
  HYPRE_StructGridAssemble(grid);
  HYPRE_StructStencilCreate(3, 4, &stencil);
  HYPRE_Int offsets[4][3] = {{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  for (int e = 0; e < 4; ++e) HYPRE_StructStencilSetElement(stencil, e, offsets[e]);
  fill(a);
  for (HYPRE_StructVector* v : {&r, &z}) {
    HYPRE_StructVectorCreate(MPI_COMM_SELF, grid, v);
    HYPRE_StructVectorInitialize(*v);
    HYPRE_StructVectorAssemble(*v);
  }
  HYPRE_StructPFMGCreate(MPI_COMM_SELF, &cycle);
  HYPRE_StructPFMGSetMaxIter(cycle, 1);
  HYPRE_StructPFMGSetTol(cycle, 0.0);
  HYPRE_StructPFMGSetZeroGuess(cycle);
  HYPRE_StructPFMGSetRelaxType(cycle, 2);  // red-black Gauss-Seidel, symmetric
  HYPRE_StructPFMGSetRAPType(cycle, 0);    // Galerkin: non-Galerkin needs constant coefficients
  HYPRE_StructPFMGSetNumPreRelax(cycle, 1);
  HYPRE_StructPFMGSetNumPostRelax(cycle, 1);
  HYPRE_StructPFMGSetSkipRelax(cycle, 0);
  HYPRE_StructPFMGSetup(cycle, A, r, z);
}

void Pfmg::Impl::fill(const PoissonMatrix& a) {
  HYPRE_StructMatrixCreate(MPI_COMM_SELF, grid, stencil, &A);
  HYPRE_StructMatrixSetSymmetric(A, 1);
  HYPRE_StructMatrixInitialize(A);
  std::vector<double> values;
  for (HYPRE_Int k = low[2]; k <= high[2]; ++k)
    for (HYPRE_Int j = low[1]; j <= high[1]; ++j)
      for (HYPRE_Int i = low[0]; i <= high[0]; ++i) {
        const bool here = unknown(a, i, j, k);
        const double diag = a.diag(i, j, k);
        const auto link = [&](bool other, double w) { return here && other ? -w : 0.0; };
        values.insert(values.end(), {here && diag > 0.0 ? diag : 1.0,
                                     link(unknown(a, i - 1, j, k), a.w[0](i, j, k)),
                                     link(unknown(a, i, j - 1, k), a.w[1](i, j, k)),
                                     link(unknown(a, i, j, k - 1), a.w[2](i, j, k))});
      }
  HYPRE_Int entries[4] = {0, 1, 2, 3};
  HYPRE_StructMatrixSetBoxValues(A, low, high, 4, entries, values.data());
  HYPRE_StructMatrixAssemble(A);
  box.resize(values.size() / 4);
}

Pfmg::Impl::~Impl() {
  HYPRE_StructPFMGDestroy(cycle);
  HYPRE_StructVectorDestroy(r);
  HYPRE_StructVectorDestroy(z);
  HYPRE_StructMatrixDestroy(A);
  HYPRE_StructStencilDestroy(stencil);
  HYPRE_StructGridDestroy(grid);
}

Pfmg::Pfmg(const PoissonMatrix& matrix) : impl_(std::make_unique<Impl>(matrix)) {}
Pfmg::~Pfmg() = default;

void Pfmg::apply(const double* r, double* z) {
  Impl& m = *impl_;
  m.for_cells([&](std::size_t n, std::size_t cell) { m.box[n] = r[cell]; });
  HYPRE_StructVectorSetBoxValues(m.r, m.low, m.high, m.box.data());
  HYPRE_StructPFMGSolve(m.cycle, m.A, m.r, m.z);
  HYPRE_StructVectorGetBoxValues(m.z, m.low, m.high, m.box.data());
  m.for_cells([&](std::size_t n, std::size_t cell) { z[cell] = m.box[n]; });
}

}  // namespace archetide
