// Membrane viscosity (Equation 10), implicit: (M/dt + beta A + D) v = b for all cells, one team and one launch for all
// iterations of a cell's conjugate gradients.
#pragma once

#include "membrane/interface.hpp"
#include "membrane/motion.hpp"
#include "membrane/stiffness.hpp"

namespace corpuscle {

/// Symmetric 3x3 matrix: xx, yy, zz, xy, xz, yz.
struct Symmetric3 {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
};

KOKKOS_INLINE_FUNCTION Symmetric3 inverse(const Symmetric3& a) {
  const double cxx = a.yy * a.zz - a.yz * a.yz, cxy = a.xz * a.yz - a.xy * a.zz, cxz = a.xy * a.yz - a.xz * a.yy;
  const double f = 1 / (a.xx * cxx + a.xy * cxy + a.xz * cxz);
  return {f * cxx, f * (a.xx * a.zz - a.xz * a.xz), f * (a.xx * a.yy - a.xy * a.xy), f * cxy, f * cxz, f * (a.xy * a.xz - a.xx * a.yz)};
}

KOKKOS_INLINE_FUNCTION Vec3 operator*(const Symmetric3& a, const Vec3& b) {
  return {a.xx * b.x + a.xy * b.y + a.xz * b.z, a.xy * b.x + a.yy * b.y + a.yz * b.z, a.xz * b.x + a.yz * b.y + a.zz * b.z};
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

/// Work arrays that exist only with membrane viscosity: all but `iterations` hold a part of the cells.
struct ViscosityViews {
  RowsFrom<Array<int>> neighbour;           // [ring entry] vertex that it leads to
  RowsFrom<Array<double>> inverse_length;   // [ring entry] 1/um, of the edge to it
  RowsFrom<Array<double>> diagonal;         // [vertex] M/dt + beta A, pg/us
  RowsFrom<Table<double>> block;            // [vertex, 6] inverse of the diagonal 3x3 block; none where the matrix is factorised
  RowsFrom<Components<double>> right_side;  // [vertex, 3] nN
  RowsFrom<Components<double>> gradient;    // [vertex, 3] dV/dx, um2
  RowsFrom<Components<double>> residual, search, image;  // [vertex, 3]
  RowsFrom<Components<double>> inverse_gradient;         // [vertex, 3] the preconditioner times that; of membranes that move with the fluid
  Array<int> iterations;                                 // [cell] of the last velocity solve; negative if it did not converge
  double times = 1;                                      // of D on the left-hand side
};

/// The neighbour that ring entry r of a vertex leads to: the next corner of that triangle.
KOKKOS_INLINE_FUNCTION int ring_vertex(const SurfaceSet& s, int r) {
  const int k = s.ring_corner(r);
  return s.triangle(s.ring_triangle(r), k == 2 ? 0 : k + 1);
}

/// D v at vertex i of membranes at s.x: minus the dissipative force, nN.
template <class Damping, class Velocity>
KOKKOS_INLINE_FUNCTION Vec3 damping_at(const SurfaceSet& s, const ViscosityViews& w, const CellLaw& law, const Velocity& v, int i) {
  const Vec3 own = load(v, i), here = load(s.x, i);
  Vec3 sum;
  for (int r = s.ring_start(i); r < s.ring_start(i + 1); ++r) {
    const int j = w.neighbour(r);
    sum += Damping::force(law, own - load(v, j), w.inverse_length(r) * (load(s.x, j) - here));
  }
  return sum;
}

/// The fluid around membranes that move with it: it moved with U under the force that it had last, and takes R = beta A + share D more
/// for each velocity beyond U. As a linear operator on the membrane D grows with the wave number as the fluid's answer does, only
/// faster: with a share of it short waves need not wait for what is right for long ones. R U less the force is carried on in time from
/// the last two steps. `force`: all others on the membrane.
struct FluidReaction {
  double beta;   // mPa s/um
  double share;  // of D
  double ahead;  // how much of what changed in the last step is expected of this one; 0 to take what the last one left
  Components<double> velocity, last_force, force;  // [vertex, 3] U, um/us; nN
  Components<double> past;  // [vertex, 3] nN, R U less the force, of the step before the last; becomes that of the last one. Zero
                            // at rest
};

/// Of D, besides itself, on the left-hand side.
template <class Load>
KOKKOS_INLINE_FUNCTION double share_of_damping(const Load&) {
  return 0;
}
KOKKOS_INLINE_FUNCTION double share_of_damping(const FluidReaction& fluid) { return fluid.share; }

/// What an edge to j adds to D U.
template <class Damping, class Load>
KOKKOS_INLINE_FUNCTION Vec3 edge_reaction(const Load&, const CellLaw&, int, int, const Vec3&) {
  return {};
}
template <class Damping>
KOKKOS_INLINE_FUNCTION Vec3 edge_reaction(const FluidReaction& fluid, const CellLaw& law, int i, int j, const Vec3& along) {
  return Damping::force(law, load(fluid.velocity, i) - load(fluid.velocity, j), along);
}

/// What drives vertex i, from inside the membrane and outside, nN. @param damping  D U there
template <class Load>
KOKKOS_INLINE_FUNCTION Vec3 driving_force(const MembraneViews& m, const Load& outside, int i, double area, const Vec3&) {
  return gather_force(m, i) + outside.force(m, i, area);
}
KOKKOS_INLINE_FUNCTION Vec3 driving_force(const MembraneViews&, const FluidReaction& fluid, int i, double area, const Vec3& damping) {
  const Vec3 last = (fluid.beta * area) * load(fluid.velocity, i) + fluid.share * damping - load(fluid.last_force, i);
  const Vec3 before = load(fluid.past, i);
  store(fluid.past, i, last);
  return load(fluid.force, i) + last + fluid.ahead * (last - before);
}

/// Right-hand side, diagonal, preconditioner and volume gradient at the current positions, of a part.
template <class Damping, class Load>
void assemble_viscous(const MembraneViews& m, const ViscosityViews& w, const Load& outside, double dt) {
  const auto x = m.surface.x, v = m.surface.v;
  Kokkos::parallel_for(
      "corpuscle::membrane::assemble_viscous", Policy(m.first_vertex, m.first_vertex + m.vertices), KOKKOS_LAMBDA(int i) {
        const CellLaw law = m.law(m.type(m.surface.vertex_body(i)));
        const double inertia = law.vertex_mass / dt;
        double area;
        store(w.gradient, i, gather_area(m, i, area));
        const double diagonal = inertia + outside.beta * area;
        w.diagonal(i) = diagonal;
        const double times = 1 + share_of_damping(outside);
        Vec3 reaction;
        Symmetric3 b;
        const int first = m.surface.ring_start(i), last = m.surface.ring_start(i + 1);
        for (int r = first; r < last; ++r) {
          const int j = ring_vertex(m.surface, r);
          Vec3 e = load(x, j) - load(x, i);
          const double inverse_length = 1 / norm(e);
          e *= inverse_length;
          w.neighbour(r) = j;
          w.inverse_length(r) = inverse_length;
          reaction += edge_reaction<Damping>(outside, law, i, j, e);
          const double c = times * law.central_damping;
          b.xx += c * e.x * e.x, b.yy += c * e.y * e.y, b.zz += c * e.z * e.z;
          b.xy += c * e.x * e.y, b.xz += c * e.x * e.z, b.yz += c * e.y * e.z;
        }
        store(w.right_side, i, inertia * load(v, i) + driving_force(m, outside, i, area, reaction));
        if (w.block.rows.extent(0) == 0) return;
        const double d = diagonal + times * (last - first) * Damping::isotropic(law);
        b.xx += d, b.yy += d, b.zz += d;
        const Symmetric3 inv = inverse(b);
        const double entries[6] = {inv.xx, inv.yy, inv.zz, inv.xy, inv.xz, inv.yz};
        for (int k = 0; k < 6; ++k) w.block(i, k) = entries[k];
      });
}

/// The matrix of one cell, beta A + D (+ M/dt), of which D counts w.times, and block Jacobi for it; sums over the cell by one team.
template <class Damping>
struct ViscousMatrix {
  MembraneViews m;
  ViscosityViews w;

  KOKKOS_INLINE_FUNCTION Vec3 precondition(int i, const Vec3& r) const {
    const Symmetric3 b{w.block(i, 0), w.block(i, 1), w.block(i, 2), w.block(i, 3), w.block(i, 4), w.block(i, 5)};
    return b * r;
  }

  template <class Velocity>
  KOKKOS_INLINE_FUNCTION Vec3 apply(const CellLaw& law, const Velocity& v, int i) const {
    return w.diagonal(i) * load(v, i) + w.times * damping_at<Damping>(m.surface, w, law, v, i);
  }

  template <class Term>
  KOKKOS_INLINE_FUNCTION double sum(const SectionTeam& team, int first, int last, const Term& term) const {
    double total = 0;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, first, last), [&](int i, double& part) { part += term(i); }, total);
    team.team_barrier();
    return total;
  }

  /// Of both terms that term(i, sums) adds.
  template <class Term>
  KOKKOS_INLINE_FUNCTION Sums<2> both(const SectionTeam& team, int first, int last, const Term& term) const {
    Sums<2> total;
    Kokkos::parallel_reduce(
        Kokkos::TeamThreadRange(team, first, last), [&](int i, Sums<2>& part) { term(i, part); }, total);
    team.team_barrier();
    return total;
  }

  template <class Work>
  KOKKOS_INLINE_FUNCTION void each(const SectionTeam& team, int first, int last, const Work& work) const {
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, first, last), work);
    team.team_barrier();
  }

  KOKKOS_INLINE_FUNCTION void finish(const SectionTeam& team, int cell, int iteration, bool converged) const {
    Kokkos::single(Kokkos::PerTeam(team), [&]() {
      w.iterations(cell) = converged ? iteration : -iteration;
      if (!converged) Kokkos::atomic_fetch_max(&m.status(0), cell + 1);
    });
  }
};

/// Conjugate gradients on one cell, by one team.
template <class Damping>
struct ViscousSolve : ViscousMatrix<Damping> {
  RowsFrom<Components<double>> right_side;  // [vertex, 3]
  Components<double> solution;              // [vertex, 3] also holds the first guess
  double tolerance;                         // of the residual over the right-hand side, both in the preconditioner's norm
  int max_iterations;

  KOKKOS_INLINE_FUNCTION ViscousSolve(const ViscousMatrix<Damping>& matrix, const RowsFrom<Components<double>>& b,
                                      const Components<double>& x, double share, int most)
      : ViscousMatrix<Damping>(matrix), right_side(b), solution(x), tolerance(share), max_iterations(most) {}

  KOKKOS_INLINE_FUNCTION void operator()(const SectionTeam& team) const {
    const MembraneViews& m = this->m;
    const ViscosityViews& w = this->w;
    const int cell = team.league_rank();
    const int first = m.surface.first_vertex(cell), last = m.surface.first_vertex(cell + 1);
    const CellLaw law = m.law(m.type(cell));
    const double scale = this->sum(team, first, last, [&](int i) {
      const Vec3 b = load(right_side, i);
      return dot(b, this->precondition(i, b));
    });
    double rz = this->sum(team, first, last, [&](int i) {
      const Vec3 r = load(right_side, i) - this->apply(law, solution, i);
      const Vec3 z = this->precondition(i, r);
      store(w.residual, i, r);
      store(w.search, i, z);
      return dot(r, z);
    });
    const double target = tolerance * tolerance * scale;
    int iteration = 0;
    while (rz > target && iteration < max_iterations) {
      const double curvature = this->sum(team, first, last, [&](int i) {
        const Vec3 q = this->apply(law, w.search, i);
        store(w.image, i, q);
        return dot(load(w.search, i), q);
      });
      const double alpha = rz / curvature;
      const double next = this->sum(team, first, last, [&](int i) {
        store(solution, i, load(solution, i) + alpha * load(w.search, i));
        const Vec3 r = load(w.residual, i) - alpha * load(w.image, i);
        store(w.residual, i, r);
        return dot(r, this->precondition(i, r));
      });
      const double ratio = next / rz;
      rz = next;
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, first, last),
                           [&](int i) { store(w.search, i, this->precondition(i, load(w.residual, i)) + ratio * load(w.search, i)); });
      team.team_barrier();
      ++iteration;
    }
    this->finish(team, cell, iteration, rz <= target);
  }
};

/// The same for velocities that change no volume: g . v = 0 with g = w.gradient, for any pressure inside. Residuals and directions
/// are kept to that (projected conjugate gradients: Gould, Hribar and Nocedal, SIAM J. Sci. Comput. 23, 2001), so that the pressure
/// costs no solve of its own. m.surface.v holds the first guess and the solution.
template <class Damping>
struct HeldViscousSolve : ViscousMatrix<Damping> {
  double tolerance;  // as ViscousSolve
  int max_iterations;

  KOKKOS_INLINE_FUNCTION HeldViscousSolve(const ViscousMatrix<Damping>& matrix, double share, int most)
      : ViscousMatrix<Damping>(matrix), tolerance(share), max_iterations(most) {}

  KOKKOS_INLINE_FUNCTION void operator()(const SectionTeam& team) const {
    const MembraneViews& m = this->m;
    const ViscosityViews& w = this->w;
    const auto& v = m.surface.v;
    const auto& h = w.inverse_gradient;
    const int cell = m.first_cell + team.league_rank();
    const int first = m.surface.first_vertex(cell), last = m.surface.first_vertex(cell + 1);
    const CellLaw law = m.law(m.type(cell));
    const Sums<2> of_gradient = this->both(team, first, last, [&](int i, Sums<2>& part) {
      const Vec3 g = load(w.gradient, i), inverse = this->precondition(i, g);
      store(h, i, inverse);
      part[0] += dot(g, inverse);
      part[1] += dot(g, load(v, i));
    });
    const double square = of_gradient[0], excess = of_gradient[1] / square;
    const double scale = this->sum(team, first, last, [&](int i) {
      const Vec3 b = load(w.right_side, i);
      store(v, i, load(v, i) - excess * load(h, i));
      return dot(b, this->precondition(i, b));
    });
    double along = this->sum(team, first, last, [&](int i) {
      const Vec3 r = load(w.right_side, i) - this->apply(law, v, i);
      store(w.residual, i, r);
      return dot(load(h, i), r);
    }) / square;
    double rz = this->sum(team, first, last, [&](int i) {
      const Vec3 r = load(w.residual, i) - along * load(w.gradient, i), z = this->precondition(i, r);
      store(w.residual, i, r);
      store(w.search, i, z);
      return dot(r, z);
    });
    const double target = tolerance * tolerance * scale;
    int iteration = 0;
    while (rz > target && iteration < max_iterations) {
      const double curvature = this->sum(team, first, last, [&](int i) {
        const Vec3 q = this->apply(law, w.search, i);
        store(w.image, i, q);
        return dot(load(w.search, i), q);
      });
      const double alpha = rz / curvature;
      const Sums<2> next = this->both(team, first, last, [&](int i, Sums<2>& part) {
        store(v, i, load(v, i) + alpha * load(w.search, i));
        const Vec3 r = load(w.residual, i) - alpha * load(w.image, i);
        store(w.residual, i, r);
        part[0] += dot(r, this->precondition(i, r));
        part[1] += dot(load(h, i), r);
      });
      along = next[1] / square;
      const double projected = next[0] - along * next[1], ratio = projected / rz;
      rz = projected;
      this->each(team, first, last, [&](int i) {
        const Vec3 r = load(w.residual, i) - along * load(w.gradient, i);
        store(w.residual, i, r);
        store(w.search, i, this->precondition(i, r) + ratio * load(w.search, i));
      });
      ++iteration;
    }
    this->finish(team, cell, iteration, rz <= target);
    const double left = this->sum(team, first, last, [&](int i) { return dot(load(w.gradient, i), load(v, i)); }) / square;
    this->each(team, first, last, [&](int i) { store(v, i, load(v, i) - left * load(h, i)); });
  }
};

constexpr double viscous_tolerance = 1e-8;  // far below the truncation error of the step; the volume does not depend on it
// A cell of n vertices has 3 n unknowns; more iterations mean a matrix that is no longer positive definite (not a number somewhere).
constexpr int viscous_iterations = 5000;

/// Teams for whole cells: on a device there are few cells for many processors, and a cell has work for more threads than Kokkos gives
/// a team by itself.
template <class Solve>
Kokkos::TeamPolicy<Exec> large_teams(int teams, [[maybe_unused]] const Solve& solve) {
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  constexpr int enough = 512;
  const int most = Kokkos::TeamPolicy<Exec>(teams, 1).team_size_max(solve, Kokkos::ParallelForTag());
  return Kokkos::TeamPolicy<Exec>(teams, most < enough ? most : enough);
#else
  return Kokkos::TeamPolicy<Exec>(teams, Kokkos::AUTO);
#endif
}

/// Solve for `solution`, which holds the first guess.
template <class Damping>
void solve_viscous(const MembraneViews& m, const ViscosityViews& w, const RowsFrom<Components<double>>& right_side,
                   const Components<double>& solution) {
  const ViscousSolve<Damping> solve({m, w}, right_side, solution, viscous_tolerance, viscous_iterations);
  Kokkos::parallel_for("corpuscle::membrane::viscous_solve", large_teams(m.cells, solve), solve);
}

/// The velocity and the answer to a uniform pressure, both with the full left-hand side.
template <class Damping, class Load>
void predict_viscous_velocity(const MembraneViews& m, const MotionViews& motion, const ViscosityViews& w, const Load& outside, double dt) {
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

/// The velocity under whatever pressure inside keeps the volume, of a part, after assemble_viscous(). A fluid that cannot be compressed
/// answers to such a pressure with no velocity at all: left to `beta`, which knows of no such load, it would take eta / (beta area) steps
/// to build up.
template <class Damping>
void solve_held(const MembraneViews& m, const ViscosityViews& w) {
  const HeldViscousSolve<Damping> solve({m, w}, viscous_tolerance, viscous_iterations);
  Kokkos::parallel_for("corpuscle::membrane::viscous_solve", large_teams(m.cells, solve), solve);
}

/// damping = D v of a part, which is taken off m.force and, if it is another array, off `force`.
template <class Damping, class Taken>
void subtract_damping(const MembraneViews& m, const ViscosityViews& w, const Components<double>& v, const Components<double>& force,
                      const Taken& damping) {
  const bool two = force.data() != m.force.data();
  Kokkos::parallel_for(
      "corpuscle::membrane::subtract_damping", Policy(m.first_vertex, m.first_vertex + m.vertices), KOKKOS_LAMBDA(int i) {
        const CellLaw law = m.law(m.type(m.surface.vertex_body(i)));
        const Vec3 taken = damping_at<Damping>(m.surface, w, law, v, i);
        store(damping, i, taken);
        store(m.force, i, load(m.force, i) - taken);
        if (two) store(force, i, load(force, i) - taken);
      });
}

/// probe = D times the unit mode, of a part.
template <class Damping>
void damp_mode(const MembraneViews& m, const ViscosityViews& w, const StiffnessViews& work) {
  Kokkos::parallel_for(
      "corpuscle::membrane::damp_mode", Policy(m.first_vertex, m.first_vertex + m.vertices), KOKKOS_LAMBDA(int i) {
        const int cell = m.surface.vertex_body(i);
        const Vec3 damped = damping_at<Damping>(m.surface, w, m.law(m.type(cell)), work.mode, i);
        store(work.probe, i, (1 / std::sqrt(section_total(work.sums, cell, 0))) * damped);
      });
}

/// D v for given velocities, into `force` with its sign: the dissipative force on each vertex, nN.
template <class Damping>
void dissipative_force(const MembraneViews& m, const ViscosityViews& w, const Components<double>& v, const Components<double>& force) {
  Kokkos::parallel_for(
      "corpuscle::membrane::dissipative_force", Policy(0, m.vertices), KOKKOS_LAMBDA(int i) {
        const CellLaw law = m.law(m.type(m.surface.vertex_body(i)));
        store(force, i, -damping_at<Damping>(m.surface, w, law, v, i));
      });
}

/// Sum of damping . v, nW.
inline double damping_power(const MembraneViews& m, const Components<float>& damping) {
  const auto v = m.surface.v;
  double power = 0;
  Kokkos::parallel_reduce(
      "corpuscle::membrane::damping_power", Policy(0, m.vertices),
      KOKKOS_LAMBDA(int i, double& sum) {
        sum += dot(Vec3{damping(i, 0), damping(i, 1), damping(i, 2)}, load(v, i));
      },
      power);
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
