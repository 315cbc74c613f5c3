// Conjugate gradients with all inner products of an iteration in one reduction. What follows from them is worked out where the fields
// are: the host need not know it to go on. Unlike the method of Chronopoulos and Gear (J. Comput. Appl. Math. 25, 1989), whose
// recurrences take the preconditioner for symmetric, all products are those of the vectors themselves; a cycle in single precision is
// symmetric to seven digits.
#pragma once

#include "common/sums.hpp"
#include "fluid/multigrid.hpp"

namespace corpuscle {

/// r: residual; z: what the cycle makes of it, times `scale`; w = A z; s: the image of the last direction.
struct CgProducts {
  enum { rr, rz, zw, zs, rw, ww, rs, ws, ss, count };
};

struct CgState {
  double scale = 1;  // r times this is what the cycle saw
  double next_scale = 1;
  double alpha = 0, beta = 0;
  double rz = 0, ps = 0;           // of the last iteration: r . z, direction . image
  double norm = 0, tolerance = 0;  // 2-norm of r, and what ends the solve
  int iterations = 0, most = 0;
  int done = 0;  // what is done beyond changes nothing
};

/// From an iteration's products to its step, and the residual that it leaves.
KOKKOS_INLINE_FUNCTION CgState cg_step(const CgState& before, const Sums<CgProducts::count>& products) {
  using P = CgProducts;
  CgState now = before;
  now.scale = before.next_scale;
  now.alpha = now.beta = 0;
  if (before.done) return now;
  const double per = 1 / now.scale;
  const double rz = per * products[P::rz], zw = per * per * products[P::zw], zs = per * products[P::zs], rw = per * products[P::rw],
               ww = per * per * products[P::ww], ws = per * products[P::ws], ss = products[P::ss], rs = products[P::rs];
  const double beta = before.iterations == 0 ? 0 : rz / before.rz;
  now.rz = rz, now.beta = beta;
  now.ps = zw + beta * (2 * zs + beta * before.ps);
  now.alpha = rz / now.ps;
  const double r_image = rw + beta * rs, image_square = ww + beta * (2 * ws + beta * ss);
  const double square = products[P::rr] - now.alpha * (2 * r_image - now.alpha * image_square);
  now.norm = square < 0 ? 0 : std::sqrt(square);  // not a number stays so
  now.next_scale = now.norm > 0 ? 1 / now.norm : 1;
  ++now.iterations;
  now.done = !(now.norm > now.tolerance) || now.iterations >= now.most || !(now.norm < 1e300);
  return now;
}

/// w = A z; products of this rank's cells. z's halo must be valid.
inline void cg_products(const LevelOperator<double>& level, const Array<CycleReal>& z, const Array<double>& r, const Array<double>& s,
                        const Array<double>& w, const Kokkos::View<Sums<CgProducts::count>, Memory>& products) {
  const IndexSpace index = level.index;
  sums_owned(
      "corpuscle::multigrid::operator", index,
      KOKKOS_LAMBDA(int i, int j, int k) {
        using P = CgProducts;
        const int c = index.cell(i, j, k);
        const double image = level.apply(z, c), own = z(c);
        w(c) = image;
        Sums<P::count> sums;
        sums[P::rr] = r(c) * r(c), sums[P::rz] = r(c) * own, sums[P::zw] = own * image, sums[P::zs] = own * s(c),
        sums[P::rw] = r(c) * image;
        sums[P::ww] = image * image, sums[P::rs] = r(c) * s(c), sums[P::ws] = image * s(c), sums[P::ss] = s(c) * s(c);
        return sums;
      },
      products);
}

inline void cg_step_on_device(const Kokkos::View<Sums<CgProducts::count>, Memory>& products, const Kokkos::View<CgState, Memory>& state) {
  const auto of = products;
  const auto now = state;
  Kokkos::parallel_for(
      "corpuscle::multigrid::step", Policy(0, 1), KOKKOS_LAMBDA(int) { now() = cg_step(now(), of()); });
}

/// The state where it is, for loops on a device; its value, for those of processors, which would read it for every cell.
struct CgOnDevice {
  Kokkos::View<CgState, Memory> state;
  KOKKOS_FORCEINLINE_FUNCTION CgState operator()() const { return state(); }
};
struct CgByValue {
  CgState state;
  KOKKOS_FORCEINLINE_FUNCTION const CgState& operator()() const { return state; }
};

/// p = z + beta p, s = w + beta s, x += alpha p, r -= alpha s; b = r as the cycle is to see it.
template <class State>
void cg_advance(const IndexSpace& index, const State& cg, const Array<CycleReal>& z, const Array<double>& w, const Array<double>& p,
                const Array<double>& s, const Array<double>& x, const Array<double>& r, const Array<CycleReal>& b) {
  const State now = cg;
  for_owned(
      "corpuscle::multigrid::advance", index, KOKKOS_LAMBDA(int i, int j, int k) {
        const CgState& step = now();
        const double alpha = step.alpha, beta = step.beta, per = 1 / step.scale, scale = step.next_scale;
        const int c = index.cell(i, j, k);
        const double direction = per * z(c) + beta * p(c), image = per * w(c) + beta * s(c);
        p(c) = direction, s(c) = image;
        x(c) += alpha * direction;
        const double left = r(c) - alpha * image;
        r(c) = left;
        b(c) = scale * left;
      });
}

}  // namespace corpuscle
