#include "cells/cell_state.hpp"

#ifdef CORPUSCLE_HDF5

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "parallel/agree.hpp"

namespace corpuscle {

namespace {

// Columns of the table of cells. The type is one of those of the case that wrote them: a restart may make types differ that
// were equal, and has its own from its case.
enum Column { type, lap_i, lap_j, lap_k, rank, first_vertex, first_triangle, columns };

const char* const table_name = "cells";
const char* const carried_name = "membranes";
const char* const numbers_name = "cell_numbers";  // steps begun, and ranks

}  // namespace

Rows vertex_rows(const SharedCells& cells) {
  Rows rows;
  for (const CellRecord& cell : cells.own()) rows.add(cell.first_vertex, cells.membranes().types()[cell.type].mesh.vertices.size());
  return rows;
}

Rows triangle_rows(const SharedCells& cells) {
  Rows rows;
  for (const CellRecord& cell : cells.own()) rows.add(cell.first_triangle, cells.membranes().types()[cell.type].mesh.triangles.size());
  return rows;
}

Rows cell_rows(const SharedCells& cells) {
  Rows rows;
  for (const CellRecord& cell : cells.own()) rows.add(cell.number, 1);
  return rows;
}

void write_cells(CheckpointWriter& file, const Comm& comm, const SharedCells& cells) {
  std::vector<std::int64_t> table;
  for (const CellRecord& cell : cells.own())
    table.insert(table.end(), {cell.type, cell.laps[0], cell.laps[1], cell.laps[2], comm.rank(), cell.first_vertex, cell.first_triangle});
  const auto width = 3 * static_cast<hsize_t>(cells.membranes().carried().size());
  file.add(table_name, {static_cast<hsize_t>(cells.total()), columns}, cell_rows(cells), table.data());
  file.add(carried_name, {static_cast<hsize_t>(cells.total_vertices()), width}, vertex_rows(cells), cells.carried().data());
  const std::int64_t numbers[2] = {cells.steps(), comm.size()};
  file.add(numbers_name, {2}, numbers);
}

namespace {

/// What the case says of the cells in this rank's share of the file, which other ranks may have. @returns in their order
std::vector<CellRecord> records_of_share(const Comm& comm, const SharedCells& cells) {
  Parcels parcels;
  for (const CellRecord& cell : cells.own()) {
    const std::int64_t after = cell.number + 1;
    put(parcels[static_cast<int>((after * comm.size() - 1) / cells.total())], &cell, 1);
  }
  std::vector<CellRecord> records;
  for (const auto& [rank, bytes] : exchange_parcels(comm, parcels))
    for (std::size_t n = 0; n < bytes.size();) n = take(bytes, n, &records.emplace_back(), 1);
  std::sort(records.begin(), records.end(), [](const CellRecord& a, const CellRecord& b) { return a.number < b.number; });
  return records;
}

}  // namespace

void read_cells(const CheckpointReader& file, const Comm& comm, SharedCells& cells) {
  std::int64_t numbers[2];
  file.read(numbers_name, {2}, numbers);
  const hsize_t total = cells.total(), width = 3 * static_cast<hsize_t>(cells.membranes().carried().size());
  // With membrane viscosity more is carried, behind the rest; where it is new it begins from zero.
  const Shape stored = file.shape(carried_name);
  const hsize_t columns_stored = stored.size() == 2 ? stored[1] : width;
  const hsize_t first = total * comm.rank() / comm.size(), last = total * (comm.rank() + 1) / comm.size();
  std::vector<CellRecord> records = records_of_share(comm, cells);
  std::vector<int> owners;
  std::vector<double> carried;
  std::string wrong;
  const Shape table_shape{total, columns}, carried_shape{static_cast<hsize_t>(cells.total_vertices()), columns_stored};
  if (last > first) {
    std::vector<std::int64_t> table((last - first) * columns);
    file.read(table_name, table_shape, Slab{{first, 0}, {last - first, columns}}, table.data());
    hsize_t vertices = 0;
    for (hsize_t c = first; c < last; ++c) {
      const std::int64_t* row = table.data() + (c - first) * columns;
      CellRecord& cell = records[c - first];
      if (row[first_vertex] != cell.first_vertex || row[first_triangle] != cell.first_triangle)
        wrong = fmt::format("cells.{}: the checkpoint has it with a mesh of another size than the case", c);
      for (int d = 0; d < 3; ++d) cell.laps[d] = static_cast<int>(row[lap_i + d]);
      if (numbers[1] == comm.size()) owners.push_back(static_cast<int>(row[rank]));
      vertices += cells.membranes().types()[cell.type].mesh.vertices.size();
    }
    std::vector<double> rows(vertices * columns_stored);
    file.read(carried_name, carried_shape, Slab{{static_cast<hsize_t>(records.front().first_vertex), 0}, {vertices, columns_stored}},
              rows.data());
    carried.assign(vertices * width, 0.0);
    for (hsize_t v = 0; v < vertices; ++v)
      for (hsize_t c = 0; c < std::min(width, columns_stored); ++c) carried[v * width + c] = rows[v * columns_stored + c];
  }
  wrong = agree(comm, wrong);
  if (!wrong.empty()) throw InputError(wrong);
  cells.restore(records, carried, owners, static_cast<long>(numbers[0]));
  if (columns_stored < width) cells.membranes().resist_anew();
}

}  // namespace corpuscle

#endif
