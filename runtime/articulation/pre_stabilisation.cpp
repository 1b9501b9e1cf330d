#include "runtime/articulation/pre_stabilisation.h"

#include <cmath>

#include "runtime/articulation/anderson.h"

namespace archetide {
namespace {

/// The jointed bodies at the end of a position update with velocities y; the others stay.
std::vector<ReducedBody> advanced(const std::vector<ReducedBody>& bodies,
                                  const std::vector<FreeMotion>& motions,
                                  const ConstrainedInverse& held, const std::vector<VecX>& y,
                                  double dt) {
  std::vector<ReducedBody> moved = bodies;
  for (const int b : held.bodies()) advance_pose(moved[b], motions[b], y[b], dt);
  return moved;
}

VecX stacked(const std::vector<VecX>& parts) {
  long size = 0, at = 0;
  for (const VecX& p : parts) size += p.size();
  VecX out(size);
  for (const VecX& p : parts) out.segment(at, p.size()) = p, at += p.size();
  return out;
}

/// The same shape as `like`.
std::vector<VecX> unstacked(const VecX& all, const std::vector<VecX>& like) {
  std::vector<VecX> out;
  long at = 0;
  for (const VecX& p : like) out.push_back(all.segment(at, p.size())), at += p.size();
  return out;
}

/// H^-1 of one body; what keeps its modal rates answers with none.
MatX inverse_of(const GeneralisedMass& H, bool stiff) {
  MatX inverse = H.inverse();
  if (stiff) inverse.bottomRightCorner(H.size() - 6, H.size() - 6).setZero();
  return inverse;
}

/// Rows of the jointed bodies of nodes.
RowsOfNodes rows_of_nodes(const std::vector<Joint>& joints, const std::vector<FreeMotion>& motions,
                          const std::vector<const ReducedBody*>& bodies) {
  RowsOfNodes nodes(bodies.size());
  std::vector<const GeneralisedMass*> H;
  for (const FreeMotion& motion : motions) H.push_back(&motion.H);
  for (const Joint& joint : joints)
    for (const int b : {joint.a, joint.b})
      if (b >= 0 && bodies[b]->nodes && !nodes[b])
        nodes[b] = std::make_unique<NodalRows>(*bodies[b], motions[b].terms);
  for (std::size_t j = 0; j < joints.size(); ++j)
    add_joint(joints[j], static_cast<int>(j), bodies, nodes);
  set_inverses(H, nodes);
  return nodes;
}

/// Of the jointed bodies as they move with y in the stage, J.
double energy_of(const ConstrainedInverse& held, const std::vector<FreeMotion>& motions,
                 const std::vector<VecX>& y) {
  double energy = 0.0;
  for (const int b : held.bodies()) energy += 0.5 * y[b].dot(motions[b].H.apply(y[b]));
  return energy;
}

/// That the impulses would give these bodies at rest, J.
double energy_taken(const ConstrainedInverse& held, const std::vector<VecX>& impulse,
                    const std::vector<VecX>& before, const std::vector<VecX>& y) {
  double energy = 0.0;
  for (const int b : held.bodies()) energy += 0.5 * impulse[b].dot(y[b] - before[b]);
  return energy;
}

int widest_joint(const std::vector<Joint>& joints, const std::vector<ReducedBody>& bodies) {
  int widest = -1;
  double most = -1.0;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const double gap = joint_drift({joints[j]}, bodies);
    if (gap > most) most = gap, widest = static_cast<int>(j);
  }
  return widest;
}

}  // namespace

// Eq. S11.
PreStabilised pre_stabilise(const std::vector<Joint>& joints,
                            const std::vector<ReducedBody>& bodies,
                            const std::vector<FreeMotion>& motions, const std::vector<char>& stiff,
                            double dt, double tolerance, double acceptable, std::vector<VecX>& y) {
  constexpr int kMaxTurns = 60, kDepth = 8, kTold = 12;
  constexpr double kSlow =
      0.1;  // of the first gap is left after kTold turns: a shorter step is quicker
  constexpr double kMostEnergy = 1.0;  // of the bodies'
  PreStabilised out;
  std::vector<const ReducedBody*> at;
  std::vector<const ConfigurationTerms*> terms;
  std::vector<MatX> inverse(bodies.size());
  std::vector<const MatX*> inverse_mass(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    at.push_back(&bodies[b]);
    terms.push_back(&motions[b].terms);
    inverse_mass[b] = &inverse[b];
  }
  std::vector<RowBlock> rows;
  const RowsOfNodes nodes = rows_of_nodes(joints, motions, at);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    for (const int b : {joints[j].a, joints[j].b})
      if (b >= 0 && nodes[b])
        inverse_mass[b] = &nodes[b]->inverse_mass();
      else if (b >= 0 && inverse[b].size() == 0)
        inverse[b] = inverse_of(motions[b].H, stiff[b] != 0);
    rows.push_back(joint_rows(joints[j], at, terms, nodes, static_cast<int>(j)));
  }
  ConstrainedInverse held;
  held.setup(inverse_mass, std::move(rows));

  out.impulse.resize(bodies.size());
  for (const int b : held.bodies()) out.impulse[b] = VecX::Zero(bodies[b].dofs());
  std::vector<MatX> answers(bodies.size());  // of bodies of nodes, once a turn needs them
  const std::vector<VecX> before = y;
  double first = 0.0;  // m, the drift before any turn
  Anderson faster(kDepth);
  VecX lambda;
  for (;; ++out.turns) {
    const std::vector<ReducedBody> moved = advanced(bodies, motions, held, y, dt);
    out.drift = joint_drift(joints, moved);
    out.converged = out.drift <= tolerance, out.closed = out.drift <= acceptable;
    if (out.converged) return out;
    if (out.turns == 0) first = out.drift;
    const bool throws = out.drift > first && !(energy_taken(held, out.impulse, before, y) <=
                                               kMostEnergy * energy_of(held, motions, before));
    const bool hopeless = out.turns == kTold && out.drift > kSlow * first;
    if (throws || hopeless || out.turns == kMaxTurns || !std::isfinite(out.drift)) {
      if (!out.closed) y = before;
      out.widest = widest_joint(joints, moved);
      return out;
    }
    std::vector<VecX> closing;
    for (const Joint& joint : joints) closing.push_back(joint_gap(joint, moved) / -dt);
    const std::vector<VecX> chord = held.solve(closing);
    const VecX newton = stacked(chord);
    if (lambda.size() == 0) lambda = VecX::Zero(newton.size());
    const VecX step = faster.step(lambda, newton);
    lambda += step;
    std::vector<VecX> f = held.impulses(unstacked(step, chord));
    for (const int b : held.bodies()) {
      if (nodes[b]) {
        out.impulse[b] += nodes[b]->force(f[b]);
        if (answers[b].size() == 0)
          answers[b] = nodes[b]->answer(MatX::Identity(f[b].size(), f[b].size()));
        y[b] += answers[b] * f[b];
        continue;
      }
      if (stiff[b]) f[b].tail(f[b].size() - 6).setZero();  // what holds the modes takes it
      out.impulse[b] += f[b];
      y[b] += inverse[b] * f[b];
    }
  }
}

}  // namespace archetide
