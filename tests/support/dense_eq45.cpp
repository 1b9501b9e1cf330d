#include "tests/support/dense_eq45.h"

#include <Eigen/Dense>
#include <tuple>

namespace archetide {
namespace {

// The particles of one body and the matrices of Sections 3 and 4, spelled out.
struct Particles3n {
  MatX M, M_inverse;     // 3n x 3n
  MatX RS;               // 3n x r
  MatX J_rigid;          // 3n x 6
  MatX M_rigid_inverse;  // 6 x 6
  MatX P_rigid, P_d;     // 3n x 3n
};

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

Particles3n particles(const ReducedBody& body, const SyntheticBody& shape) {
  const auto n = static_cast<Eigen::Index>(shape.nodes().size());
  const Mat3 R = body.rotation.toRotationMatrix();
  const MatX S = shape.archetype->node_modes.leftCols(body.r);
  const VecX displacement = S * body.q;
  Particles3n p;
  p.M = MatX::Zero(3 * n, 3 * n);
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b)
      p.M.block<3, 3>(3 * a, 3 * b)
          .diagonal()
          .setConstant(body.mass_scale * shape.scalar_mass(a, b));
  p.M_inverse = p.M.inverse();
  p.RS.resize(3 * n, body.r);
  p.J_rigid.resize(3 * n, 6);
  for (Eigen::Index a = 0; a < n; ++a) {
    p.RS.middleRows<3>(3 * a) = R * S.middleRows<3>(3 * a);
    const Vec3 r = R * (shape.nodes()[a] + displacement.segment<3>(3 * a));
    p.J_rigid.block<3, 3>(3 * a, 0).setIdentity();
    p.J_rigid.block<3, 3>(3 * a, 3) = cross_matrix(r).transpose();  // Eq. 4
  }
  p.M_rigid_inverse = (p.J_rigid.transpose() * p.M * p.J_rigid).inverse();
  p.P_rigid = p.M * p.J_rigid * p.M_rigid_inverse * p.J_rigid.transpose();  // Eq. 11
  p.P_d = MatX::Identity(3 * n, 3 * n) - p.P_rigid;
  return p;
}

MatX impulse_factor(const Particles3n& p, const MatX& M_hat) {
  // Eq. 43: K_lambda = P_rigid^T M^-1 P_rigid + P_d^T R S Mhat^-1 S^T R^-1 P_d
  MatX K = p.P_rigid.transpose() * p.M_inverse * p.P_rigid;
  if (M_hat.rows() > 0) K += p.P_d.transpose() * p.RS * M_hat.inverse() * p.RS.transpose() * p.P_d;
  return K;
}

struct Face {
  int axis;
  Vec3i at;
  int low = -1, high = -1;  // water unknowns on its sides, -1: none
  double beta;              // dual-cell mass, kg
  int constraint = -1;      // row of W, or -1
};

}  // namespace

VecX solve_semi_definite(const MatX& A, const VecX& b) {
  const VecX scale = A.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::CompleteOrthogonalDecomposition<MatX> factor;
  factor.setThreshold(1e-11);
  factor.compute(scale.asDiagonal() * A * scale.asDiagonal());
  return scale.asDiagonal() * factor.solve(VecX(scale.asDiagonal() * b));
}

MatX dense_motion(const ReducedBody& body, const SyntheticBody& shape) {
  const Particles3n p = particles(body, shape);
  MatX motion(p.M.rows(), 6 + body.r);
  motion << p.J_rigid, p.P_d.transpose() * p.RS;
  return motion;
}

MatX dense_impulse_factor(const ReducedBody& body, const SyntheticBody& shape, const MatX& M_hat) {
  return impulse_factor(particles(body, shape), M_hat);
}

DenseSolution solve_eq45(const CoupledTank& tank, const std::vector<const SyntheticBody*>& shapes,
                         double dt) {
  return solve_eq49(tank, shapes, dt, {});
}

DenseSolution solve_eq49(const CoupledTank& tank, const std::vector<const SyntheticBody*>& shapes,
                         double dt, const std::vector<DenseJoint>& joints) {
  const CouplingOptions& o = tank.options;
  const Grid& g = o.grid;
  const double area = g.dx * g.dx, beta = o.hydrostatics.density * area * g.dx;

  // Voxel geometry: cells inside bodies, constraint faces.
  SolidFractions fractions;
  fractions.face.resize(g, 0.0);
  fractions.cell.resize(g.nx, g.ny, g.nz, 0.0);
  std::vector<BodySurface> surfaces;
  std::vector<VoxelBody> voxels;
  for (const ReducedBody& b : tank.bodies) {
    surfaces.push_back(body_surface(b, o.modal.mass));
    voxels.push_back(voxel_body(g, surfaces.back(), fractions));
  }
  Array3<int> unknown(g.nx, g.ny, g.nz, -1);
  int cells = 0;
  for (std::size_t n = 0; n < unknown.size(); ++n)
    if (o.has_water && fractions.cell[n] == 0.0) unknown[n] = cells++;
  FaceField<int> row(g, -1);
  std::vector<const ConstraintFace*> constraints;
  std::vector<int> owner;
  for (std::size_t b = 0; b < voxels.size(); ++b)
    for (const ConstraintFace& f : voxels[b].faces)
      if (unknown(f.outer[0], f.outer[1], f.outer[2]) >= 0) {
        row[f.axis](f.face[0], f.face[1], f.face[2]) = static_cast<int>(constraints.size());
        constraints.push_back(&f);
        owner.push_back(static_cast<int>(b));
      }

  // Faces that carry water: between water cells, at open sides (half a dual cell), at bodies.
  std::vector<Face> faces;
  const auto cell = [&](const Vec3i& c) {
    return unknown.contains(c[0], c[1], c[2]) ? unknown(c[0], c[1], c[2]) : -1;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int k = 0; k < row[axis].nz(); ++k)
      for (int j = 0; j < row[axis].ny(); ++j)
        for (int i = 0; i < row[axis].nx(); ++i) {
          const Vec3i at(i, j, k);
          Face f{axis, at, cell(at - Vec3i::Unit(axis)), cell(at), beta, row[axis](i, j, k)};
          const bool side = at[axis] == 0 || at[axis] == g.size(axis);
          if (side && !o.open_side[2 * axis + (at[axis] > 0)]) continue;
          if (side) f.beta *= 0.5;
          const bool between = f.low >= 0 && f.high >= 0;
          if (between || f.constraint >= 0 || (side && (f.low >= 0 || f.high >= 0)))
            faces.push_back(f);
        }
  const auto nf = static_cast<Eigen::Index>(faces.size()),
             nl = static_cast<Eigen::Index>(constraints.size());
  MatX G = MatX::Zero(nf, cells), W = MatX::Zero(nl, nf);
  VecX beta_inverse(nf), u_star(nf);
  for (Eigen::Index f = 0; f < nf; ++f) {
    if (faces[f].low >= 0) G(f, faces[f].low) -= area;
    if (faces[f].high >= 0) G(f, faces[f].high) += area;
    if (faces[f].constraint >= 0) W(faces[f].constraint, f) = 1.0;
    beta_inverse[f] = 1.0 / faces[f].beta;
    u_star[f] = tank.u[faces[f].axis](faces[f].at[0], faces[f].at[1], faces[f].at[2]);
  }

  // Bodies: W J (rows of constraint faces, columns of particles), K_lambda, and Eqs. 32 to 35
  // and 44.
  MatX WJK = MatX::Zero(nl, nl);
  VecX WJv = VecX::Zero(nl);
  const auto na = 3 * static_cast<Eigen::Index>(joints.size());
  MatX a_23 = MatX::Zero(nl, na), a_33 = MatX::Zero(na, na);  // Eqs. 46, 47
  VecX rhs_a = VecX::Zero(na);                                // Eq. 48
  struct Solid {
    Particles3n p;
    MatX WJ, M_hat;
    MatX J_a;         // J_ap where this is a joint's first body, -J_ac where it is its second
    VecX q_dot_star;  // M_r q_dot* = M_r q_dot + S^T R^-1 P_d (explicit impulses) - dt K q
    Vec3 P, L;
    MatX M_r;
  };
  std::vector<Solid> solids;
  for (std::size_t b = 0; b < tank.bodies.size(); ++b) {
    const ReducedBody& body = tank.bodies[b];
    Solid s;
    s.p = particles(body, *shapes[b]);
    const FreeMotion motion =
        free_motion(body, current_configuration(body), VecX::Zero(body.dofs()), dt,
                    Stage::kVelocityFull, o.modal);
    s.M_hat = motion.H.M_hat;
    s.M_r = motion.terms.M_q;
    s.P = body.P, s.L = body.L;
    if (body.r > 0) s.q_dot_star = s.M_r.ldlt().solve(s.M_hat * motion.y_star.tail(body.r));
    s.WJ = MatX::Zero(nl, s.p.M.rows());
    const auto& to_node = body.archetype->surface_to_node;
    for (Eigen::Index c = 0; c < nl; ++c) {
      if (owner[c] != static_cast<int>(b)) continue;
      const Vec3i& t = body.archetype->surface.triangles[constraints[c]->triangle];
      for (int v = 0; v < 3; ++v)
        s.WJ(c, 3 * to_node[t[v]] + constraints[c]->axis) += constraints[c]->bary[v];
    }
    const MatX K = impulse_factor(s.p, s.M_hat);
    WJK += s.WJ * K * s.WJ.transpose();
    s.J_a = MatX::Zero(na, s.p.M.rows());
    for (std::size_t j = 0; j < joints.size(); ++j)
      for (const auto& [which, vertex, sign] :
           {std::tuple(joints[j].a, joints[j].p, 1.0), std::tuple(joints[j].b, joints[j].c, -1.0)})
        if (which == static_cast<int>(b))
          s.J_a.block<3, 3>(3 * static_cast<Eigen::Index>(j), 3 * to_node[vertex]) =
              sign * Mat3::Identity();
    a_23 -= s.WJ * K * s.J_a.transpose();
    a_33 += s.J_a * K * s.J_a.transpose();
    VecX momentum(6);
    momentum << s.P, s.L;
    VecX v_star = s.p.J_rigid * (s.p.M_rigid_inverse * momentum);
    if (body.r > 0) {
      // v* = R S q_dot* + J_rigid v_rigid*, v_rigid* from the momentum; plus the last term of Eq.
      // 44
      v_star += s.p.P_d.transpose() * s.p.RS * s.q_dot_star;
      v_star +=
          s.p.P_d.transpose() * s.p.RS * (s.M_hat.inverse() * s.M_r * s.q_dot_star - s.q_dot_star);
    }
    WJv += s.WJ * v_star;
    rhs_a -= s.J_a * v_star;
    solids.push_back(std::move(s));
  }

  // Eq. 45, with joints Eq. 49.
  const MatX BG = beta_inverse.asDiagonal() * G, BW = beta_inverse.asDiagonal() * W.transpose();
  MatX A = MatX::Zero(cells + nl + na, cells + nl + na);
  A.topLeftCorner(cells, cells) = G.transpose() * BG;
  A.block(0, cells, cells, nl) = -G.transpose() * BW;
  A.block(cells, 0, nl, cells) = -W * BG;
  A.block(cells, cells, nl, nl) = W * BW + WJK;
  A.block(cells, cells + nl, nl, na) = a_23;
  A.block(cells + nl, cells, na, nl) = a_23.transpose();
  A.bottomRightCorner(na, na) = a_33;
  VecX rhs(cells + nl + na);
  rhs.head(cells) = G.transpose() * u_star;
  rhs.segment(cells, nl) = -W * u_star + WJv;
  rhs.tail(na) = rhs_a;
  const VecX x = na > 0 ? solve_semi_definite(A, rhs) : VecX(A.ldlt().solve(rhs));
  const VecX p = x.head(cells), lambda = x.segment(cells, nl), lambda_a = x.tail(na);

  DenseSolution out;
  out.pressure = p / (o.hydrostatics.density * g.dx);
  const VecX u = u_star - BG * p + BW * lambda;
  for (Eigen::Index f = 0; f < nf; ++f) out.faces.push_back({faces[f].axis, faces[f].at, u[f]});
  for (std::size_t b = 0; b < solids.size(); ++b) {
    const Solid& s = solids[b];
    // impulses on the particles
    const VecX f = -s.WJ.transpose() * lambda + s.J_a.transpose() * lambda_a;
    VecX momentum(6), y(tank.bodies[b].dofs());
    momentum << s.P, s.L;
    momentum += s.p.J_rigid.transpose() * f;
    y.head(6) = s.p.M_rigid_inverse * momentum;
    if (tank.bodies[b].r > 0)
      y.tail(tank.bodies[b].r) =
          s.M_hat.ldlt().solve(s.M_r * s.q_dot_star + s.p.RS.transpose() * s.p.P_d * f);
    out.body.push_back(y);
  }
  return out;
}

}  // namespace archetide
