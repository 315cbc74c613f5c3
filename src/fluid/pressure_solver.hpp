// A pressure equation given as matrix rows: hypre's flexible GMRES, and its BoomerAMG.
#pragma once

#include "fluid/bicgstab.hpp"
#include "fluid/pressure_matrix.hpp"
#include "parallel/halo.hpp"

#include <functional>
#include <memory>

namespace corpuscle {

/// The matrix keeps its sparsity for the whole run: rows of nodes that are not fluid hold only a diagonal. So a change
/// of the immersed nodes changes values only.
class PressureSolver {
 public:
  /// @param skewed  rows of 19 entries, not 7
  PressureSolver(const Comm& comm, const IndexSpace& index, Halo& halo, bool skewed, int max_iterations);
  ~PressureSolver();
  PressureSolver(const PressureSolver&) = delete;
  PressureSolver& operator=(const PressureSolver&) = delete;

  const RowPattern& pattern() const { return pattern_; }
  /// [row, pattern().count] coefficients; fill it (pressure_rows), then call set_values().
  const Table<double>& values() const { return value_; }
  void set_values();

  /// Solve for `x` from zero until the residual's 2-norm is below `absolute_tolerance`, or ten digits below that of
  /// `rhs`: then solve again for what is left. The `residual` returned is that of the start.
  KrylovResult solve(const Array<double>& rhs, const Array<double>& x, double absolute_tolerance);
  /// x = one BoomerAMG cycle from zero, a symmetric operator. @pre set_up()
  void cycle(const Array<double>& rhs, const Array<double>& x);

  /// Precondition with BoomerAMG for the matrix as it is now. @pre set_values()
  void set_up();
  /// Precondition with `apply(b, x)` instead, on compact vectors.
  void precondition_with(std::function<void(const Array<double>&, const Array<double>&)> apply);

 private:
  struct Hypre;
  void load(const Array<double>& rhs, const Array<double>& x);

  std::unique_ptr<Hypre> hypre_;
  Comm comm_;
  RowPattern pattern_;
  Table<double> value_;
  Table<int> slot_;       // [row, entry] position in the packed arrays, -1 for no entry
  Array<double> packed_;  // coefficients as hypre takes them
  Array<int> row_, column_, row_length_;
  std::function<void(const Array<double>&, const Array<double>&)> preconditioner_;
  bool krylov_ready_ = false;
  int rows_ = 0;
};

}  // namespace corpuscle
