// Membrane viscosity (Equation 10), implicit: (M/dt + beta A + D) v = b for all cells, one team and one launch for all
// iterations of a cell's conjugate gradients.
#pragma once

#include "membrane/motion.hpp"

namespace corpuscle {

/// Symmetric 3x3 matrix: xx, yy, zz, xy, xz, yz.
struct Symmetric3 {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
};

KOKKOS_INLINE_FUNCTION Symmetric3 inverse(const Symmetric3& a) {
  const double cxx = a.yy * a.zz - a.yz * a.yz, cxy = a.xz * a.yz - a.xy * a.zz, cxz = a.xy * a.yz - a.xz * a.yy;
  const double f = 1 / (a.xx * cxx + a.xy * cxy + a.xz * cxz);
  return {f * cxx, f * (a.xx * a.zz - a.xz * a.xz), f * (a.xx * a.yy - a.xy * a.xy), f * cxy,
          f * cxz, f * (a.xy * a.xz - a.xx * a.yz)};
}

KOKKOS_INLINE_FUNCTION Vec3 operator*(const Symmetric3& a, const Vec3& b) {
  return {a.xx * b.x + a.xy * b.y + a.xz * b.z, a.xy * b.x + a.yy * b.y + a.yz * b.z,
          a.xz * b.x + a.yz * b.y + a.zz * b.z};
}

/// Damping along the edges only: objective, rigid rotation is free.
struct CentralDamping {
  KOKKOS_INLINE_FUNCTION static Vec3 force(const CellLaw& law, const Vec3& relative, const Vec3& along) {
    return (law.central_damping * dot(relative, along)) * along;
  }
  KOKKOS_INLINE_FUNCTION static double isotropic(const CellLaw&) { return 0; }
};

/// Equation 11: resists every relative velocity, and with it rigid rotation.
struct FullDamping {
  KOKKOS_INLINE_FUNCTION static Vec3 force(const CellLaw& law, const Vec3& relative, const Vec3& along) {
    return law.tangential_damping * relative + (law.central_damping * dot(relative, along)) * along;
  }
  KOKKOS_INLINE_FUNCTION static double isotropic(const CellLaw& law) { return law.tangential_damping; }
};

/// Work arrays that exist only with membrane viscosity.
struct ViscosityViews {
  Table<double> along;                         // [ring entry, 3] unit vector to the neighbour
  Array<double> diagonal;                      // [vertex] M/dt + beta A, pg/us
  Table<double> block;                         // [vertex, 6] inverse of the diagonal 3x3 block
  Components<double> right_side;               // [vertex, 3] nN
  Components<double> gradient;                 // [vertex, 3] dV/dx, um2
  Components<double> residual, search, image;  // [vertex, 3]
  Array<int> iterations;                       // [cell] of the last velocity solve; negative if it did not converge
};

/// The neighbour that ring entry r of a vertex leads to: the next corner of that triangle.
KOKKOS_INLINE_FUNCTION int ring_vertex(const SurfaceSet& s, int r) {
  const int k = s.ring_corner(r);
  return s.triangle(s.ring_triangle(r), k == 2 ? 0 : k + 1);
}

/// D v at vertex i: minus the dissipative force, nN.
template <class Damping, class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 damping_at(const SurfaceSet& s, const Table<double>& along, const CellLaw& law,
                                       const Velocity& v, int i) {
  const Vec3 own = load(v, i);
  Vec3 sum;
  for (int r = s.ring_start(i); r < s.ring_start(i + 1); ++r) {
    sum += Damping::force(law, own - load(v, ring_vertex(s, r)), load(along, r));
  }
  return sum;
}

/// The fluid around membranes that move with it: it moved with U under the force that it had last, and takes beta more for each
/// area and each velocity beyond U. `force`: all others on the membrane.
struct FluidReaction {
  double beta;  // mPa s/um
  Components<double> velocity, last_force, force;  // [vertex, 3] U, um/us; nN
};

/// What drives vertex i, from inside the membrane and outside, nN.
template <class Load>
KOKKOS_INLINE_FUNCTION Vec3 driving_force(const MembraneViews& m, const Load& outside, int i, double area) {
  return gather_force(m, i) + outside.force(m, i, area);
}
KOKKOS_INLINE_FUNCTION Vec3 driving_force(const MembraneViews&, const FluidReaction& fluid, int i, double area) {
  return (fluid.beta * area) * load(fluid.velocity, i) + load(fluid.force, i) - load(fluid.last_force, i);
}

/// Right-hand side, diagonal, preconditioner and volume gradient at the current positions.
template <class Damping, class Load>
void assemble_viscous(const MembraneViews& m, const ViscosityViews& w, const Load& outside, double dt) {
  const auto x = m.surface.x, v = m.surface.v;
  Kokkos::parallel_for(
      "corpuscle::membrane::assemble_viscous", Policy(0, m.vertices), KOKKOS_LAMBDA(int i) {
        const CellLaw law = m.law(m.type(m.surface.vertex_body(i)));
        const double inertia = law.vertex_mass / dt;
        double area;
        store(w.gradient, i, gather_area(m, i, area));
        const double diagonal = inertia + outside.beta * area;
        w.diagonal(i) = diagonal;
        store(w.right_side, i, inertia * load(v, i) + driving_force(m, outside, i, area));
        Symmetric3 b;
        const int first = m.surface.ring_start(i), last = m.surface.ring_start(i + 1);
        for (int r = first; r < last; ++r) {
          Vec3 e = load(x, ring_vertex(m.surface, r)) - load(x, i);
          e *= 1 / norm(e);
          store(w.along, r, e);
          const double c = law.central_damping;
          b.xx += c * e.x * e.x, b.yy += c * e.y * e.y, b.zz += c * e.z * e.z;
          b.xy += c * e.x * e.y, b.xz += c * e.x * e.z, b.yz += c * e.y * e.z;
        }
        const double d = diagonal + (last - first) * Damping::isotropic(law);
        b.xx += d, b.yy += d, b.zz += d;
        const Symmetric3 inv = inverse(b);
        const double entries[6] = {inv.xx, inv.yy, inv.zz, inv.xy, inv.xz, inv.yz};
        for (int k = 0; k < 6; ++k) w.block(i, k) = entries[k];
      });
}

/// Conjugate gradients with block Jacobi on one cell, by one team.
template <class Damping>
struct ViscousSolve {
  MembraneViews m;
  ViscosityViews w;
  Components<double> right_side, solution;  // [vertex, 3]; the solution also holds the first guess
  double tolerance;  // of the residual over the right-hand side, both in the preconditioner's norm
  int max_iterations;

  KOKKOS_INLINE_FUNCTION Vec3 precondition(int i, const Vec3& r) const {
    const Symmetric3 b{w.block(i, 0), w.block(i, 1), w.block(i, 2), w.block(i, 3), w.block(i, 4), w.block(i, 5)};
    return b * r;
  }

  template <class Velocity>
  KOKKOS_INLINE_FUNCTION Vec3 apply(const CellLaw& law, const Velocity& v, int i) const {
    return w.diagonal(i) * load(v, i) + damping_at<Damping>(m.surface, w.along, law, v, i);
  }

  template <class Term>
  KOKKOS_INLINE_FUNCTION double sum(const SectionTeam& team, int first, int last, const Term& term) const {
    double total = 0;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, first, last), [&](int i, double& part) { part += term(i); }, total);
    team.team_barrier();
    return total;
  }

  KOKKOS_INLINE_FUNCTION void operator()(const SectionTeam& team) const {
    const int cell = team.league_rank();
    const int first = m.surface.first_vertex(cell), last = m.surface.first_vertex(cell + 1);
    const CellLaw law = m.law(m.type(cell));
    const double scale = sum(team, first, last, [&](int i) {
      const Vec3 b = load(right_side, i);
      return dot(b, precondition(i, b));
    });
    double rz = sum(team, first, last, [&](int i) {
      const Vec3 r = load(right_side, i) - apply(law, solution, i);
      const Vec3 z = precondition(i, r);
      store(w.residual, i, r);
      store(w.search, i, z);
      return dot(r, z);
    });
    const double target = tolerance * tolerance * scale;
    int iteration = 0;
    while (rz > target && iteration < max_iterations) {
      const double curvature = sum(team, first, last, [&](int i) {
        const Vec3 q = apply(law, w.search, i);
        store(w.image, i, q);
        return dot(load(w.search, i), q);
      });
      const double alpha = rz / curvature;
      const double next = sum(team, first, last, [&](int i) {
        store(solution, i, load(solution, i) + alpha * load(w.search, i));
        const Vec3 r = load(w.residual, i) - alpha * load(w.image, i);
        store(w.residual, i, r);
        return dot(r, precondition(i, r));
      });
      const double ratio = next / rz;
      rz = next;
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, first, last), [&](int i) {
        store(w.search, i, precondition(i, load(w.residual, i)) + ratio * load(w.search, i));
      });
      team.team_barrier();
      ++iteration;
    }
    const bool converged = rz <= target;
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      w.iterations(cell) = converged ? iteration : -iteration;
      if (!converged) Kokkos::atomic_fetch_max(&m.status(0), cell + 1);
    });
  }
};

/// Solve for `solution`, which holds the first guess.
template <class Damping>
void solve_viscous(const MembraneViews& m, const ViscosityViews& w, const Components<double>& right_side,
                   const Components<double>& solution) {
  // 1e-8: far below the truncation error of the step; the volume does not depend on it. A cell of n vertices has 3 n
  // unknowns; more iterations than 5000 mean a matrix that is no longer positive definite (not a number somewhere).
  Kokkos::parallel_for("corpuscle::membrane::viscous_solve", Kokkos::TeamPolicy<Exec>(m.cells, Kokkos::AUTO),
                       ViscousSolve<Damping>{m, w, right_side, solution, 1e-8, 5000});
}

/// The velocity and the answer to a uniform pressure, both with the full left-hand side.
template <class Damping, class Load>
void predict_viscous_velocity(const MembraneViews& m, const MotionViews& motion, const ViscosityViews& w,
                              const Load& outside, double dt) {
  assemble_viscous<Damping>(m, w, outside, dt);
  solve_viscous<Damping>(m, w, w.gradient, motion.direction);
  solve_viscous<Damping>(m, w, w.right_side, m.surface.v);
  const auto v = m.surface.v;
  for_sections(
      "corpuscle::membrane::viscous_sums", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        Sums<2> total;
        Kokkos::parallel_reduce(
            section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
            [&](int i, Sums<2>& sum) {
              sum[0] += dot(load(v, i), load(w.gradient, i));
              sum[1] += dot(load(motion.direction, i), load(w.gradient, i));
            },
            total);
        Kokkos::single(Kokkos::PerTeam(team), [&]() {
          motion.sums(cell * sections + section, 0) = total[0];
          motion.sums(cell * sections + section, 1) = total[1];
        });
      });
}

/// v without any change of volume, after predict_viscous_velocity(). A fluid that cannot be compressed answers to a pressure inside
/// with no velocity at all: left to `beta`, which knows of no such load, it would take eta / (beta area) steps to build up.
inline void keep_volume(const MembraneViews& m, const MotionViews& motion) {
  const auto v = m.surface.v;
  for_sections(
      "corpuscle::membrane::keep_volume", m.cells, KOKKOS_LAMBDA(const SectionTeam& team, int cell, int section) {
        const double factor = -section_total(motion.sums, cell, 0) / section_total(motion.sums, cell, 1);
        Kokkos::parallel_for(section_range(team, m.surface.first_vertex(cell), m.surface.first_vertex(cell + 1), section),
                             [&](int i) { store(v, i, load(v, i) + factor * load(motion.direction, i)); });
      });
}

/// damping = D v, which is taken off m.force and, if it is another array, off `force`.
template <class Damping>
void subtract_damping(const MembraneViews& m, const Table<double>& along, const Components<double>& v,
                      const Components<double>& force, const Components<double>& damping) {
  const bool two = force.data() != m.force.data();
  Kokkos::parallel_for(
      "corpuscle::membrane::subtract_damping", Policy(0, m.vertices), KOKKOS_LAMBDA(int i) {
        const CellLaw law = m.law(m.type(m.surface.vertex_body(i)));
        const Vec3 taken = damping_at<Damping>(m.surface, along, law, v, i);
        store(damping, i, taken);
        store(m.force, i, load(m.force, i) - taken);
        if (two) store(force, i, load(force, i) - taken);
      });
}

/// D v for given velocities, into `force` with its sign: the dissipative force on each vertex, nN.
template <class Damping>
void dissipative_force(const MembraneViews& m, const Components<double>& v, const Table<double>& along,
                       const Components<double>& force) {
  Kokkos::parallel_for(
      "corpuscle::membrane::dissipative_force", Policy(0, m.vertices), KOKKOS_LAMBDA(int i) {
        const CellLaw law = m.law(m.type(m.surface.vertex_body(i)));
        store(force, i, -damping_at<Damping>(m.surface, along, law, v, i));
      });
}

/// Sum of damping . v, nW.
inline double damping_power(const MembraneViews& m, const Components<double>& damping) {
  const auto v = m.surface.v;
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::membrane::damping_power", Policy(0, m.vertices),
      KOKKOS_LAMBDA(int i, double& sum) { sum += dot(load(damping, i), load(v, i)); }, power);
  return power;
}

/// v . D v over all membranes, nW.
template <class Damping>
double viscous_power(const MembraneViews& m) {
  const auto x = m.surface.x, v = m.surface.v;
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::membrane::viscous_power", Policy(0, m.vertices),
      KOKKOS_LAMBDA(int i, double& sum) {
        const CellLaw law = m.law(m.type(m.surface.vertex_body(i)));
        for (int r = m.surface.ring_start(i); r < m.surface.ring_start(i + 1); ++r) {
          const int j = ring_vertex(m.surface, r);
          Vec3 along = load(x, j) - load(x, i);
          along *= 1 / norm(along);
          sum += dot(load(v, i), Damping::force(law, load(v, i) - load(v, j), along));
        }
      },
      power);
  return power;
}

}  // namespace corpuscle
