// A pressure equation given as matrix rows, in hypre's hands.
#pragma once

#include "fluid/hypre_errors.hpp"
#include "fluid/pressure_matrix.hpp"
#include "parallel/halo.hpp"

#include <HYPRE_IJ_mv.h>
#include <HYPRE_parcsr_mv.h>

namespace corpuscle {

/// The matrix keeps its sparsity for the whole run: rows of nodes that are not fluid hold only a diagonal. So a change
/// of the immersed nodes changes values only. One solver a system: it works on the system's two vectors.
class HypreSystem {
 public:
  /// @param skewed  rows of 19 entries, not 7
  /// @throws ComputationError  when hypre fails
  HypreSystem(const Comm& comm, const IndexSpace& index, Halo& halo, bool skewed);
  ~HypreSystem();
  HypreSystem(const HypreSystem&) = delete;
  HypreSystem& operator=(const HypreSystem&) = delete;

  const RowPattern& pattern() const { return pattern_; }
  /// [row, pattern().count] coefficients; fill it (pressure_rows), then call set_values().
  const Table<double>& values() const { return value_; }
  void set_values();

  /// Compact vectors into hypre's, and hypre's solution back.
  void load(const Array<double>& rhs, const Array<double>& x);
  void read(const Array<double>& x);

  int rows() const { return rows_; }
  const Comm& comm() const { return comm_; }
  /// Of all calls that concern this system; those of set_values(), load() and read() are not raised there.
  HypreErrors& errors() { return errors_; }
  HYPRE_ParCSRMatrix matrix() const { return a_; }
  HYPRE_ParVector rhs() const { return b_; }
  HYPRE_ParVector x() const { return y_; }

 private:
  void number_entries(const IndexSpace& index, Halo& halo, int first);
  void create(int first);

  Comm comm_;
  RowPattern pattern_;
  Table<double> value_;
  Table<int> slot_;       // [row, entry] position in the packed arrays, -1 for no entry
  Array<double> packed_;  // coefficients as hypre takes them
  Array<int> row_, column_, row_length_;
  int rows_ = 0;
  HypreErrors errors_;
  HYPRE_IJMatrix ij_matrix_ = nullptr;
  HYPRE_IJVector ij_rhs_ = nullptr, ij_x_ = nullptr;
  HYPRE_ParCSRMatrix a_ = nullptr;
  HYPRE_ParVector b_ = nullptr, y_ = nullptr;
};

}  // namespace corpuscle
