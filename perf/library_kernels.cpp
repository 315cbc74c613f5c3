// Kokkos Kernels beside this program's own loops and hypre's product, for the same work in one run:
//   library_kernels CELLS_ALONG_A_SIDE [REPEATS]
// Prints a markdown table: shortest time of each and their ratio. The two are run in turn.
#include <KokkosBatched_LU_Decl.hpp>
#include <KokkosBatched_LU_Serial_Impl.hpp>
#include <KokkosBatched_SolveLU_Decl.hpp>
#include <KokkosBlas1_dot.hpp>
#include <KokkosBlas1_update.hpp>
#include <KokkosSparse_CrsMatrix.hpp>
#include <KokkosSparse_spmv.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "common/small_linear.hpp"
#include "fluid/fluid_solver.hpp"
#include "fluid/hypre_system.hpp"
#include "grid/generators.hpp"
#include "program.hpp"

using namespace corpuscle;

namespace {

template <class Work>
double seconds(const Work& work) {
  Exec().fence();
  const auto start = std::chrono::steady_clock::now();
  work();
  Exec().fence();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <class Library, class Own>
void compare(const std::string& what, int repeats, const Library& library, const Own& own) {
  double theirs = 1e300, ours = 1e300;
  for (int n = 0; n < repeats; ++n) {
    theirs = std::min(theirs, seconds(library));
    ours = std::min(ours, seconds(own));
  }
  std::printf("| %s | %.3g | %.3g | %.2f |\n", what.c_str(), 1e6 * theirs, 1e6 * ours, theirs / ours);
}

void vectors(int entries, int repeats) {
  const Array<double> a("corpuscle::perf::a", entries), b("corpuscle::perf::b", entries);
  Kokkos::deep_copy(a, 1.5);
  Kokkos::deep_copy(b, 0.5);
  volatile double kept = 0;
  const std::string size = std::to_string(entries) + " entries";
  compare(
      "dot, " + size, repeats, [&] { kept = KokkosBlas::dot(a, b); },
      [&] {
        double sum = 0;
        Kokkos::parallel_reduce(
            "corpuscle::perf::dot", Policy(0, entries), KOKKOS_LAMBDA(int i, double& s) { s += a(i) * b(i); }, sum);
        kept = sum;
      });
  const Array<double> c("corpuscle::perf::c", entries);
  compare(
      "extrapolation of a scalar in time, " + size, repeats, [&] { KokkosBlas::update(1.25, a, -0.25, b, 0.0, c); },
      [&] { extrapolate(0.25, a, b, c); });
  const Components<double> u("corpuscle::perf::u", entries, 3), v("corpuscle::perf::v", entries, 3), w("corpuscle::perf::w", entries, 3);
  compare(
      "the same of a velocity", repeats, [&] { KokkosBlas::update(1.25, u, -0.25, v, 0.0, w); }, [&] { extrapolate(0.25, u, v, w); });
  static_cast<void>(kept);
}

/// Normal equations of N unknowns, one of each vertex: factorise and solve.
template <int N>
void fits(int systems, int repeats) {
  using Matrices = Kokkos::View<double***, Kokkos::LayoutRight, Exec::memory_space>;
  using Vectors = Kokkos::View<double**, Kokkos::LayoutRight, Exec::memory_space>;
  const Matrices given("corpuscle::perf::given", systems, N, N), matrix("corpuscle::perf::matrix", systems, N, N);
  const Vectors rhs("corpuscle::perf::rhs", systems, N);
  Kokkos::parallel_for(
      "corpuscle::perf::fill", Policy(0, systems), KOKKOS_LAMBDA(int s) {
        for (int r = 0; r < N; ++r)
          for (int c = 0; c < N; ++c) given(s, r, c) = 1.0 / (1 + r + c) + (r == c ? 1 : 0);
      });
  compare(
      "factorise and solve " + std::to_string(N) + " unknowns, " + std::to_string(systems) + " systems", repeats,
      [&] {
        Kokkos::parallel_for(
            "corpuscle::perf::batched", Policy(0, systems), KOKKOS_LAMBDA(int s) {
              auto a = Kokkos::subview(matrix, s, Kokkos::ALL(), Kokkos::ALL());
              auto b = Kokkos::subview(rhs, s, Kokkos::ALL());
              for (int r = 0; r < N; ++r) {
                b(r) = 1;
                for (int c = 0; c < N; ++c) a(r, c) = given(s, r, c);
              }
              KokkosBatched::SerialLU<KokkosBatched::Algo::LU::Unblocked>::invoke(a);
              KokkosBatched::SerialSolveLU<KokkosBatched::Trans::NoTranspose, KokkosBatched::Algo::SolveLU::Unblocked>::invoke(a, b);
            });
      },
      [&] {
        Kokkos::parallel_for(
            "corpuscle::perf::own_fit", Policy(0, systems), KOKKOS_LAMBDA(int s) {
              NormalMatrix<N> normal;
              double b[N];
              for (int r = 0; r < N; ++r) {
                b[r] = 1;
                for (int c = 0; c <= r; ++c) normal.a[NormalMatrix<N>::at(r, c)] = given(s, r, c);
              }
              normal.factorise(1e-12);
              normal.solve(b);
              for (int r = 0; r < N; ++r) rhs(s, r) = b[r];
            });
      });
}

/// The product with a pressure matrix of a skewed grid, 19 entries a row, beside hypre's.
void product(int cells, int repeats) {
  const double h = 1.0 / cells;
  const NodeSource source{{cells, cells, cells}, [&](int i, int j, int k) {
                            return Triple{h * i + 0.1 * h * j, h * j + 0.1 * h * k, h * k};
                          }};
  Grid grid(Comm(), source, {false, false, false});
  HypreSystem system(grid.comm(), grid.index(), grid.halo(), true);
  const int rows = system.rows(), count = system.pattern().count;
  Kokkos::deep_copy(system.values(), 1.0);
  system.set_values();
  // The same sparsity as a CSR matrix: neighbours by compact number, those beyond the block left out.
  std::vector<int> row_map{0}, columns;
  const int n = grid.index().n[0];
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        for (int dk = -1; dk <= 1; ++dk)
          for (int dj = -1; dj <= 1; ++dj)
            for (int di = -1; di <= 1; ++di) {
              const int a = i + di, b = j + dj, c = k + dk;
              if (std::abs(di) + std::abs(dj) + std::abs(dk) > 2 || std::min({a, b, c}) < 0 || std::max({a, b, c}) >= n) continue;
              columns.push_back(a + n * (b + n * c));
            }
        row_map.push_back(static_cast<int>(columns.size()));
      }
  using Matrix = KokkosSparse::CrsMatrix<double, int, Kokkos::Device<Exec, Exec::memory_space>, void, int>;
  std::vector<double> values(columns.size(), 1.0);
  const Matrix matrix("corpuscle::perf::csr", rows, rows, static_cast<int>(columns.size()), values.data(), row_map.data(), columns.data());
  const Array<double> x("corpuscle::perf::x", rows), y("corpuscle::perf::y", rows);
  Kokkos::deep_copy(x, 1.0);
  system.load(x, y);
  compare(
      "product, " + std::to_string(rows) + " rows of up to " + std::to_string(count) + " (own: hypre's)", repeats,
      [&] { KokkosSparse::spmv("N", 1.0, matrix, x, 0.0, y); },
      [&] { HYPRE_ParCSRMatrixMatvec(1.0, system.matrix(), system.rhs(), 0.0, system.x()); });
}

}  // namespace

int main(int argc, char** argv) {
  return run_program(argc, argv, 1, "CELLS_ALONG_A_SIDE [REPEATS]", [](int count, char** words) {
    const int cells = std::atoi(words[1]), repeats = count > 2 ? std::atoi(words[2]) : 50;
    std::printf("| work | Kokkos Kernels, us | own, us | ratio |\n|---|---|---|---|\n");
    vectors(cells * cells * cells, repeats);
    fits<4>(500, repeats);
    fits<4>(20000, repeats);
    fits<9>(500, repeats);
    fits<9>(20000, repeats);
    product(cells, repeats);
  });
}
