// Deterministic sums per cell: each cell's triangles and vertices are cut into a fixed number of sections, each section
// is summed by one team, and whoever needs the total adds the sections in order.
#pragma once

#include <string>

#include "common/sums.hpp"

namespace corpuscle {

inline constexpr int sections = 16;  // enough parallel work for one small cell, few enough to add again where needed

using SectionTeam = typename Kokkos::TeamPolicy<Exec>::member_type;

/// Which cells a kernel is for: all of `count`,
struct AllCells {
  int count = 0;
  int first = 0;
  KOKKOS_INLINE_FUNCTION int operator()(int n) const { return first + n; }
};

/// or those of a list.
struct ListedCells {
  Array<int> cells;  // rising
  int count = 0;
  int first = 0;  // in the list
  KOKKOS_INLINE_FUNCTION int operator()(int n) const { return cells(first + n); }
};

template <class Cells, class Body>
struct SectionKernel {
  Cells cells;
  Body body;
  KOKKOS_INLINE_FUNCTION void operator()(const SectionTeam& team) const {
    body(team, cells(team.league_rank() / sections), team.league_rank() % sections);
  }
};

/// Run body(team, cell, section) for every section of the cells.
template <class Cells, class Body>
void for_sections_of(const std::string& label, const Cells& cells, const Body& body) {
  if (cells.count == 0) return;
  Kokkos::parallel_for(label, Kokkos::TeamPolicy<Exec>(cells.count * sections, Kokkos::AUTO), SectionKernel<Cells, Body>{cells, body});
}

/// Of every cell.
template <class Body>
void for_sections(const std::string& label, int cells, const Body& body) {
  for_sections_of(label, AllCells{cells}, body);
}

/// The part of [first, last) that belongs to a section, shared out over the team.
KOKKOS_INLINE_FUNCTION auto section_range(const SectionTeam& team, int first, int last, int section) {
  const int count = last - first, per = count / sections, rest = count % sections;
  const int begin = first + section * per + (section < rest ? section : rest);
  return Kokkos::TeamThreadRange(team, begin, begin + per + (section < rest ? 1 : 0));
}

/// Sum of one column over the sections of a cell. @param sums  [cells * sections, columns]
KOKKOS_INLINE_FUNCTION double section_total(const Table<double>& sums, int cell, int column) {
  double total = 0;
  for (int s = 0; s < sections; ++s) total += sums(cell * sections + s, column);
  return total;
}

}  // namespace corpuscle
