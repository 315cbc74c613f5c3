// Indexing of one rank's block of a structured grid.
#pragma once

#include "common/sums.hpp"
#include "common/types.hpp"

#include <array>

namespace corpuscle {

/// Owned cells are 0 <= i < n[0] and so on; `halo` layers around them belong to neighbours, periodic images or the
/// boundary. Views over cells are one-dimensional with i fastest, so that a neighbour is one stride away.
///
/// Beyond a physical (not periodic) boundary the first layer is the boundary itself: its "cell centres" are the
/// centres of the boundary faces (edges and corners alike), so a velocity stored there is the boundary's own. Layers
/// two and three beyond a physical boundary are void: never read.
struct IndexSpace {
  static constexpr int halo = 3;

  int n[3] = {0, 0, 0};       // owned cells
  int first[3] = {0, 0, 0};   // global index of the first owned cell
  int global[3] = {0, 0, 0};  // cells of the whole grid
  bool periodic[3] = {false, false, false};

  KOKKOS_INLINE_FUNCTION int padded(int d) const { return n[d] + 2 * halo; }
  KOKKOS_INLINE_FUNCTION int size() const { return padded(0) * padded(1) * padded(2); }
  KOKKOS_INLINE_FUNCTION int owned() const { return n[0] * n[1] * n[2]; }
  KOKKOS_INLINE_FUNCTION int stride(int d) const { return d == 0 ? 1 : (d == 1 ? padded(0) : padded(0) * padded(1)); }
  /// Position in a cell view of local cell (i, j, k), each from -halo to n + halo - 1.
  KOKKOS_INLINE_FUNCTION int cell(int i, int j, int k) const { return (i + halo) + padded(0) * ((j + halo) + padded(1) * (k + halo)); }
  KOKKOS_INLINE_FUNCTION void unpack(int c, int& i, int& j, int& k) const {
    i = c % padded(0) - halo;
    j = (c / padded(0)) % padded(1) - halo;
    k = c / (padded(0) * padded(1)) - halo;
  }
  KOKKOS_INLINE_FUNCTION bool owns(int i, int j, int k) const { return i >= 0 && i < n[0] && j >= 0 && j < n[1] && k >= 0 && k < n[2]; }
  /// Compact number of owned cell (i, j, k), 0 to owned() - 1.
  KOKKOS_INLINE_FUNCTION int compact(int i, int j, int k) const { return i + n[0] * (j + n[1] * k); }
  /// visit(i, j, k, more...) for the owned cell whose compact number is e. Every loop over plain numbers comes through here,
  /// those that only a device runs too, so that tests on the host see what it does.
  template <class Visit, class... More>
  KOKKOS_FORCEINLINE_FUNCTION auto visit_compact(int e, const Visit& visit, More&... more) const {
    return visit(e % n[0], (e / n[0]) % n[1], e / (n[0] * n[1]), more...);
  }
};

/// What a node of the grid (a cell centre) is to the flow solver.
enum class NodeKind : std::int8_t {
  fluid = 0,     // momentum and continuity are solved here
  immersed = 1,  // outside a body, next to its surface: velocity reconstructed
  inside = 2,    // inside a body: blanked
  boundary = 3,  // first layer beyond a physical boundary: velocity known there
  none = 4       // void layers
};

/// A box of cells lower <= (i, j, k) < upper.
struct CellBox {
  std::array<int, 3> lower{}, upper{};
  int size() const {
    int n = 1;
    for (int d = 0; d < 3; ++d) n *= upper[d] > lower[d] ? upper[d] - lower[d] : 0;
    return n;
  }
};

/// Boxes that have no cell in common, as plain numbers.
struct CellBoxes {
  static constexpr int most = 6;
  int count = 0;
  int lower[most][3], wide[most][3];
  int end[most];  // cells of the boxes so far

  void add(const CellBox& box) {
    if (box.size() == 0) return;
    for (int d = 0; d < 3; ++d) lower[count][d] = box.lower[d], wide[count][d] = box.upper[d] - box.lower[d];
    end[count] = size() + box.size();
    ++count;
  }
  int size() const { return count > 0 ? end[count - 1] : 0; }
  CellBox box(int b) const {
    CellBox box;
    for (int d = 0; d < 3; ++d) box.lower[d] = lower[b][d], box.upper[d] = lower[b][d] + wide[b][d];
    return box;
  }
  /// visit(b, i, j, k) for the cell that comes e-th in the order of the boxes.
  template <class Visit>
  KOKKOS_FORCEINLINE_FUNCTION void visit(int e, const Visit& visit) const {
    int b = 0;
    while (e >= end[b]) ++b;
    const int at = b > 0 ? e - end[b - 1] : e;
    visit(b, lower[b][0] + at % wide[b][0], lower[b][1] + at / wide[b][0] % wide[b][1], lower[b][2] + at / (wide[b][0] * wide[b][1]));
  }
};

// A loop over cells vectorises only if all that it calls is inlined.
#if defined(__GNUC__)
#define CORPUSCLE_INLINE_ALL __attribute__((flatten))
#else
#define CORPUSCLE_INLINE_ALL
#endif

/// One thread's share of the lines of cells along i that make up a box.
class LineShare {
 public:
  LineShare(const std::array<int, 3>& lower, const std::array<int, 3>& upper, int thread, int threads)
      : lower_j_(lower[1]), upper_j_(upper[1]) {
    const int wide = upper[1] - lower[1];
    const long lines = static_cast<long>(wide) * (upper[2] - lower[2]);
    const int first = static_cast<int>(lines * thread / threads);
    left_ = static_cast<int>(lines * (thread + 1) / threads) - first;
    j = lower[1] + first % wide, k = lower[2] + first / wide;
  }
  bool any() const { return left_ > 0; }
  void next() {
    --left_;
    if (++j == upper_j_) j = lower_j_, ++k;
  }

  int j, k;

 private:
  int left_, lower_j_, upper_j_;
};

/// Where a loop of one iteration runs: in the thread that calls, where there are processors alone.
#if defined(KOKKOS_ENABLE_SERIAL) && !defined(KOKKOS_ENABLE_CUDA) && !defined(KOKKOS_ENABLE_HIP)
using CallingThread = Kokkos::Serial;
#else
using CallingThread = Exec;
#endif

#if !defined(KOKKOS_ENABLE_CUDA) && !defined(KOKKOS_ENABLE_HIP)
/// Boxes of fewer cells than this are done by the calling thread. Waking the others and waiting for them costs 2 us with a
/// core for each, and many times that where other work has one of the cores; a cell costs 1 to 5 ns.
constexpr int worth_threads = 2048;

/// Run `body(i, j, k)` for one thread's share of the lines of a box, and body.end_line(j, k), if there is one, after each line; or
/// body.line(begin, end, j, k), if there is that.
template <class Body>
void run_lines(const std::array<int, 3>& lower, const std::array<int, 3>& upper, int thread, int threads, const Body& body) {
  const Body cell = body;  // on the stack, where the compiler sees that no store changes what it holds
  const int begin = lower[0], end = upper[0];
  for (LineShare line(lower, upper, thread, threads); line.any(); line.next()) {
    const int j = line.j, k = line.k;
    if constexpr (requires { cell.line(begin, end, j, k); }) {
      cell.line(begin, end, j, k);
      continue;
    }
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
    for (int i = begin; i < end; ++i) cell(i, j, k);
    if constexpr (requires { cell.end_line(j, k); }) cell.end_line(j, k);
  }
}

/// Sum of `body(i, j, k)` over one thread's share of the lines of a box from (0, 0, 0).
template <class Body>
double sum_lines(const std::array<int, 3>& upper, int thread, int threads, const Body& body) {
  const Body cell = body;
  const int end = upper[0];
  double sum = 0;
  for (LineShare line({0, 0, 0}, upper, thread, threads); line.any(); line.next()) {
    const int j = line.j, k = line.k;
    double part = 0;
#pragma omp simd reduction(+ : part)
    for (int i = 0; i < end; ++i) part += cell(i, j, k);
    sum += part;
  }
  return sum;
}

/// The same of up to nine sums, which vector reductions want by name.
template <int n, class Body>
void sum_lines(const std::array<int, 3>& upper, int thread, int threads, const Body& body, Sums<n>& total) {
  static_assert(n <= 9);
  const Body cell = body;
  const int end = upper[0];
  for (LineShare line({0, 0, 0}, upper, thread, threads); line.any(); line.next()) {
    const int j = line.j, k = line.k;
    double a = 0, b = 0, c = 0, d = 0, e = 0, f = 0, g = 0, h = 0, l = 0;
#pragma omp simd reduction(+ : a, b, c, d, e, f, g, h, l)
    for (int i = 0; i < end; ++i) {
      const Sums<n> s = cell(i, j, k);
      a += s[0];
      if constexpr (n > 1) b += s[1];
      if constexpr (n > 2) c += s[2];
      if constexpr (n > 3) d += s[3];
      if constexpr (n > 4) e += s[4];
      if constexpr (n > 5) f += s[5];
      if constexpr (n > 6) g += s[6];
      if constexpr (n > 7) h += s[7];
      if constexpr (n > 8) l += s[8];
    }
    const double parts[9] = {a, b, c, d, e, f, g, h, l};
    for (int m = 0; m < n; ++m) total[m] += parts[m];
  }
}
#endif

/// Run `body(i, j, k)` for every cell of the box lower <= (i, j, k) < upper. Cells must be independent of each other: on
/// the host each line of cells along i is a vectorised loop.
template <class Body>
void for_box(const std::string& label, const std::array<int, 3>& lower, const std::array<int, 3>& upper, const Body& body) {
  if (upper[0] <= lower[0] || upper[1] <= lower[1] || upper[2] <= lower[2]) return;
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  using Range =
      Kokkos::MDRangePolicy<Exec, Kokkos::Rank<3, Kokkos::Iterate::Left, Kokkos::Iterate::Left>, Kokkos::IndexType<int>, WithLaunch>;
  Kokkos::parallel_for(label, Range({lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}, {32, 4, 2}), body);
#else
  // One iteration a thread: what a line costs beside its cells is soon as much as the cells of a short one.
  const int threads = Exec().concurrency();
  const auto share = [=](int thread) CORPUSCLE_INLINE_ALL { run_lines(lower, upper, thread, threads, body); };
  const double cells = static_cast<double>(upper[0] - lower[0]) * (upper[1] - lower[1]) * (upper[2] - lower[2]);
  if (cells < worth_threads)
    Kokkos::parallel_for(label, Kokkos::RangePolicy<CallingThread>(0, threads), share);
  else
    Kokkos::parallel_for(label, Policy(0, threads), share);
#endif
}

/// Run `body(b, i, j, k)` for every cell of boxes b, in one launch.
template <class Body>
void for_boxes(const std::string& label, const CellBoxes& boxes, const Body& body) {
  const int cells = boxes.size();
  if (cells == 0) return;
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  const CellBoxes in = boxes;
  Kokkos::parallel_for(
      label, Policy(0, cells), KOKKOS_LAMBDA(int e) { in.visit(e, body); });
#else
  const int threads = Exec().concurrency();
  const auto share = [=](int thread) CORPUSCLE_INLINE_ALL {
    for (int b = 0; b < boxes.count; ++b) {
      const CellBox box = boxes.box(b);
      run_lines(box.lower, box.upper, thread, threads, [=](int i, int j, int k) CORPUSCLE_INLINE_ALL { body(b, i, j, k); });
    }
  };
  if (cells < worth_threads)
    Kokkos::parallel_for(label, Kokkos::RangePolicy<CallingThread>(0, threads), share);
  else
    Kokkos::parallel_for(label, Policy(0, threads), share);
#endif
}

/// Run `body(i, j, k)` for every owned cell.
template <class Body>
void for_owned(const std::string& label, const IndexSpace& index, const Body& body) {
  for_box(label, {0, 0, 0}, {index.n[0], index.n[1], index.n[2]}, body);
}

/// Run `body(i, j, k)` for every cell of a box where it does no harm to run it for up to three cells of the halo behind each of this
/// rank's own lines too: on the host those are made up to a multiple of four, since the cells left over when the vectors are full cost
/// as much as the others.
template <class Body>
void for_box_rounded(const std::string& label, const IndexSpace& index, const CellBox& box, const Body& body) {
  auto upper = box.upper;
#if !defined(KOKKOS_ENABLE_CUDA) && !defined(KOKKOS_ENABLE_HIP)
  static_assert(IndexSpace::halo >= 3);
  if (box.lower[0] == 0 && upper[0] == index.n[0]) upper[0] = (index.n[0] + 3) / 4 * 4;
#endif
  for_box(label, box.lower, upper, body);
}
/// The same for the owned cells.
template <class Body>
void for_owned_rounded(const std::string& label, const IndexSpace& index, const Body& body) {
  for_box_rounded(label, index, {{0, 0, 0}, {index.n[0], index.n[1], index.n[2]}}, body);
}

/// Sum of `body(i, j, k)` over this rank's owned cells. The order of summation depends on the number of threads only,
/// not on which of them does the work.
template <class Body>
double sum_owned(const std::string& label, const IndexSpace& index, const Body& body) {
  double sum = 0;
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  Kokkos::parallel_reduce(
      label, Policy(0, index.owned()), KOKKOS_LAMBDA(int e, double& total) { total += index.visit_compact(e, body); }, sum);
#else
  const std::array<int, 3> upper{index.n[0], index.n[1], index.n[2]};
  const int threads = Exec().concurrency();
  const auto share = [=](int thread, double& total) CORPUSCLE_INLINE_ALL { total += sum_lines(upper, thread, threads, body); };
  if (index.owned() < worth_threads)
    Kokkos::parallel_reduce(label, Kokkos::RangePolicy<CallingThread>(0, threads), share, sum);
  else
    Kokkos::parallel_reduce(label, Policy(0, threads), share, sum);
#endif
  return sum;
}

/// Several sums in one reduction, on the device or where the host can wait for them: `body(i, j, k)` returns a Sums<n>, n up to 9.
template <int n, class Body>
void sums_owned(const std::string& label, const IndexSpace& index, const Body& body, const Kokkos::View<Sums<n>, Memory>& result) {
  const Kokkos::Sum<Sums<n>, Memory> into(result);
#if defined(KOKKOS_ENABLE_CUDA) || defined(KOKKOS_ENABLE_HIP)
  Kokkos::parallel_reduce(
      label, Policy(0, index.owned()), KOKKOS_LAMBDA(int e, Sums<n>& total) { total += index.visit_compact(e, body); }, into);
#else
  const std::array<int, 3> upper{index.n[0], index.n[1], index.n[2]};
  const int threads = Exec().concurrency();
  const auto share = [=](int thread, Sums<n>& total) CORPUSCLE_INLINE_ALL { sum_lines(upper, thread, threads, body, total); };
  if (index.owned() < worth_threads)
    Kokkos::parallel_reduce(label, Kokkos::RangePolicy<CallingThread>(0, threads), share, into);
  else
    Kokkos::parallel_reduce(label, Policy(0, threads), share, into);
#endif
}

}  // namespace corpuscle
