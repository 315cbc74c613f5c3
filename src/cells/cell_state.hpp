// Shared cells in checkpoints: every rank its own, in the order of their numbers, readable on any number of ranks.
#pragma once

#ifdef CORPUSCLE_HDF5

#include "cells/shared_cells.hpp"
#include "output/checkpoint.hpp"

namespace corpuscle {

/// Every rank calls.
void write_cells(CheckpointWriter& file, const Comm& comm, const SharedCells& cells);

/// Every rank calls: it reads a share of the cells, whosever they are, and passes them on. On as many ranks as wrote them each
/// has those that it had.
/// @throws InputError  the checkpoint has other cells
void read_cells(const CheckpointReader& file, const Comm& comm, SharedCells& cells);

/// Rows of the own cells' vertices and triangles in files, and of the cells themselves.
Rows vertex_rows(const SharedCells& cells);
Rows triangle_rows(const SharedCells& cells);
Rows cell_rows(const SharedCells& cells);

}  // namespace corpuscle

#endif
