#pragma once

#include <vector>

#include "runtime/coupling/coupling.h"

namespace archetide {

/// Joints and contacts of one stage. The contact solver tells which contacts press and which of
/// them stick; those are held as rows of the coupled solve together with the joints. What slides is
/// given its friction as an impulse.
///
/// Of a body of nodes contacts and joints see the velocities z = J y of its points only (NodalRows,
/// [D60]); velocities that come in or go out are whole ones, except where it says `at rows`.
class StageConstraints {
 public:
  /// Contacts between bodies, or else (no shapes) the points at walls that `results` have.
  /// `coupled`: its inverse masses must stay where they are. `wet_inverse`: of every body in water,
  /// how it answers an impulse once the water has: (H + added mass)^-1, roughly; of a body of nodes
  /// N, where that is H^-1 less X N X^T with X the answers to reduced forces; empty: no water.
  StageConstraints(const CouplingOptions& options, double dt, const std::vector<Joint>& joints,
                   const std::vector<StageBody>& bodies, const GroupContacts& contacts,
                   const std::vector<CoupledBody>& coupled, const std::vector<StageResult>& results,
                   std::vector<MatX> wet_inverse);
  StageConstraints(const StageConstraints&) = delete;
  StageConstraints& operator=(const StageConstraints&) = delete;

  std::size_t contacts() const { return system_.size(); }
  int sweeps() const { return sweeps_; }
  const ContactSystem& system() const { return system_; }
  const std::vector<Vec3>& impulses() const { return lambda_; }  // of the contacts, frame, N s

  /// First guesses: what pushed in the last step, for a stage of length h.
  void start_from_last_step(const GroupContacts& contacts, double h);
  /// y at rows.
  std::vector<VecX> at_rows(const std::vector<VecX>& y) const;
  /// Impulses of the contacts, joints kept, on bodies that move with y_free (at rows) without any
  /// of them.
  void resolve(const std::vector<VecX>& y_free);
  /// y_free at rows in water, before the solve: bodies at y once the water pushes as it did last,
  /// first guesses of the contacts included.
  std::vector<VecX> expected_free(const std::vector<VecX>& y) const;
  /// y_free at rows in water, after the solve: its velocities less what joints and contacts gave.
  std::vector<VecX> free_of_rows(const std::vector<CoupledBody>& coupled) const;
  /// Takes joints and, under water, what presses as rows; without water contacts are resolved
  /// already.
  void hold();
  const ConstrainedInverse* held() const { return &held_; }

  /// y* of the coupled solve: y_star, sliding friction added and rows kept.
  void start(const std::vector<VecX>& y_star, std::vector<CoupledBody>& coupled) const;
  /// What joints and contacts give to bodies that the water alone would move with y_free.
  void settle(const std::vector<VecX>& y_free, std::vector<CoupledBody>& coupled,
              std::vector<StageResult>& results);
  /// Whether the contact solver's last answer moves the contacts that push as the coupled solve
  /// does, and lets no other approach faster than it may, within `speed`, m/s.
  bool agrees(const std::vector<CoupledBody>& coupled, double speed) const;

 private:
  Vec3 held_speed(std::size_t k) const;
  std::vector<VecX> with_given(std::vector<VecX> at_rows) const;
  VecX moved(std::size_t b, const VecX& y, const VecX& f) const;
  std::vector<VecX> at_held(std::vector<VecX> y) const;
  std::vector<VecX> from_held(const std::vector<VecX>& f) const;
  void find_held_answers(std::size_t b, std::vector<RowBlock>& rows);
  VecX on_body(std::size_t b, const VecX& f) const;
  bool wet() const { return !wet_inverse_.empty(); }

  std::vector<ConfigurationTerms> terms_;
  RowsOfNodes nodes_;
  std::vector<const MatX*> inverse_mass_;  // at rows
  std::vector<MatX> wet_inverse_;          // at rows
  ContactSystem system_;
  VecX target_;  // m/s
  ContactSolveOptions solve_;
  std::vector<RowBlock> joint_rows_;
  ConstrainedInverse joints_, held_;
  // Of bodies of nodes: as they are without rows, what they answer to the rows that are held (in
  // held_ they have these alone) and to what they are given, or empty.
  std::vector<std::shared_ptr<const NodalBody>> bodies_of_nodes_;
  std::vector<std::shared_ptr<const RowAnswers>> held_answers_;
  std::vector<VecX> given_answers_;
  std::vector<MatX> held_mass_;
  std::vector<Vec3> lambda_;
  std::vector<bool> pressed_;   // contacts that the coupled solve knows to push
  std::vector<VecX> resolved_;  // y at rows that the contact solver has found
  // Per body, at rows: generalised impulse of contacts that are not held, and of all contacts and
  // joints together; or empty.
  std::vector<VecX> given_, reaction_;
  int sweeps_ = 0;
};

}  // namespace archetide
