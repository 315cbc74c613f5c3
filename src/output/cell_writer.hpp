// cells.h5 and cells.xdmf: the surfaces of all cells and bodies at stored times, as ParaView opens them; of the bodies beside cells that
// are shared out bodies.h5 and bodies.xdmf.
#pragma once

#ifdef CORPUSCLE_HDF5

#include "output/series.hpp"

namespace corpuscle {

/// Values at all vertices, components of one vertex side by side: host memory of vertices * components numbers.
struct VertexField {
  std::string name;  // with its unit
  int components;    // 1 or 3
  const double* values;
};

/// Values of cells, as VertexField, for shared surfaces.
using CellTable = VertexField;

/// What a rank has of surfaces that are shared out over ranks.
struct SurfaceShare {
  hsize_t vertices = 0, triangles = 0, cells = 0;  // of all ranks
  Rows vertex_rows, triangle_rows, cell_rows;      // this one's
};

/// Rank 0 writes where every rank holds all surfaces; each its own where they are shared out.
class CellWriter {
 public:
  /// @param triangles   three vertex numbers each, over all bodies
  /// @param bodies      body of each triangle
  /// @param vertices    how many there are
  /// @param restart_us  an existing file keeps its times up to this one and is continued; absent: a new file
  /// @param name        of the files
  /// @throws InputError  on every rank, if the files cannot be written or the one to continue has other surfaces
  CellWriter(const std::string& folder, const Comm& comm, const std::vector<std::int32_t>& triangles,
             const std::vector<std::int32_t>& bodies, int vertices, std::optional<double> restart_us = {},
             const std::string& name = "cells");

  /// Surfaces that are shared out: three vertex numbers and the body of each of this rank's triangles. Every rank calls.
  CellWriter(const std::string& folder, const Comm& comm, const std::vector<std::int32_t>& triangles,
             const std::vector<std::int32_t>& bodies, const SurfaceShare& mine, std::optional<double> restart_us = {});

  /// Store one time (in a stretching test, which has no time, the force in pN). A step that is there already is
  /// replaced.
  /// @param x  vertex positions, vertices * 3, um
  /// @throws ComputationError  on every rank, for example on a full disk
  void write(double time_us, long step, const double* x, const std::vector<VertexField>& fields = {});
  /// The same of surfaces that are shared out: x and fields of this rank's vertices, `tables` of its cells. Every rank calls.
  void write(double time_us, long step, const SurfaceShare& mine, const double* x, const std::vector<VertexField>& fields,
             const std::vector<CellTable>& tables);

 private:
  void begin(const std::string& folder, std::optional<double> restart_us, const std::function<void()>& create);
  void create(const std::vector<std::int32_t>& triangles, const std::vector<std::int32_t>& bodies);
  void create_shared(const std::vector<std::int32_t>& triangles, const std::vector<std::int32_t>& bodies, const SurfaceShare& mine);
  void require_same_surfaces(const std::string& path) const;
  std::string describe(const StoredTime& time, const Hdf5File& file) const;

  Comm comm_;
  std::string name_;
  hsize_t vertices_, triangles_;
  Series series_;
};

}  // namespace corpuscle

#endif
