#include "runtime/coupling/narrow_faces.h"

#include <gtest/gtest.h>

namespace archetide {
namespace {

struct Field {
  Grid grid{4, 4, 4, 1.0, Vec3::Zero()};
  MacField u;
  FaceField<double> open;
  Field() {
    u.resize(grid, 0.0);
    open.resize(grid, 1.0);
    for (int a = 0; a < 3; ++a) u[a].fill(a == 0 ? 2.0 : 0.0);
  }
  std::size_t face() const { return u[0].index(2, 1, 1); }
};

// What a solve left in a narrow face is what the next one starts from, however it is shared between
// the field and the excess.
TEST(NarrowFaces, GiveBackWhatASolveLeft) {
  for (const double solved : {2.0, 2.3, 1.2, 3.9}) {
    Field f;
    f.open[0][f.face()] = 0.2;
    const NarrowFlow flow = settle_after({{0, f.face(), 0.2, 5.0, solved}}, f.u);
    add_narrow_flow(flow, f.open, f.u);
    EXPECT_NEAR(f.u[0][f.face()], solved, 1e-15);
  }
}

// The velocity before a half step's solve comes back from u + push.
TEST(NarrowFaces, GiveBackWhatAHalfStepStartedFrom) {
  Field f;
  MacField push;
  push.resize(f.grid, 0.0);
  push[0].fill(0.5);
  f.open[0][f.face()] = 0.2;
  const NarrowFlow flow = settle_before({{0, f.face(), 0.2, 3.1, 2.2}}, f.u, push);
  f.u[0][f.face()] += push[0][f.face()];
  add_narrow_flow(flow, f.open, f.u);
  EXPECT_NEAR(f.u[0][f.face()], 3.1, 1e-15);
}

// Advection is shown a quarter of the speed around beyond what is continued at most, and no face
// carries more than that speed on top.
TEST(NarrowFaces, ThatShootAreHeldBack) {
  Field f;
  const NarrowFlow flow = settle_after({{0, f.face(), 1e-5, 0.0, 400.0}}, f.u);
  EXPECT_NEAR(f.u[0][f.face()], 2.5, 1e-15);
  EXPECT_NEAR(flow.excess[0], 2.0, 1e-15);
}

// A face that opens shares the excess with the water that comes in: w excess stays. One that closes
// has none.
TEST(NarrowFaces, KeepTheirMomentumAsTheyOpen) {
  Field f;
  NarrowFlow flow;
  flow.add({0, f.face(), 0.1, 0.0, 0.0}, 1.0);
  f.open[0][f.face()] = 0.4;
  add_narrow_flow(flow, f.open, f.u);
  EXPECT_NEAR(f.u[0][f.face()], 2.25, 1e-15);
  f.open[0][f.face()] = 0.0;
  add_narrow_flow(flow, f.open, f.u);
  EXPECT_NEAR(f.u[0][f.face()], 2.25, 1e-15);
}

}  // namespace
}  // namespace archetide
