// What passes between cells and their copies, on other ranks and on their own, in every step: positions and forces to the
// copies, and what the copies have found back.
#pragma once

#include <array>
#include <vector>

#include "cells/cell_parcels.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

class CopyMessages {
 public:
  /// A copy, as its cell's rank or the copy's own sees it.
  struct Copy {
    int rank;  // the other one's
    int cell;  // on this rank
    int vertices;
    int image;   // which shift
    Vec3 shift;  // um
  };

  CopyMessages() = default;
  /// @param sent      copies of this rank's cells, by rank and in each rank in the order in which it has them received
  /// @param received  copies that this rank holds
  void set(const Comm& comm, const std::vector<Copy>& sent, const std::vector<Copy>& received);

  /// Values of a field [vertex, up to 3] from the cells to the copies. @param positions  they are shifted
  void to_copies(const SurfaceSet& set, const Components<double>& field, bool positions);
  /// The cells' values become the sums over them and their copies, in the order of ranks and images.
  void add_copies(const SurfaceSet& set, const Components<double>& field);

  /// Vertices in the messages that this rank sends to copies, and gets.
  int sent_vertices() const { return outgoing_.vertices; }
  int received_vertices() const { return incoming_.vertices; }

 private:
  struct Segment {
    int rank, first, count;  // vertices
  };
  struct Side {
    ParcelViews parcels;
    std::vector<Segment> segments;
    int vertices = 0;
    Table<double> message;  // [vertex, 3]
    HostMirror<Table<double>> host;
  };
  void set_side(const std::vector<Copy>& copies, Side& side);
  void set_parts(const std::vector<Copy>& sent);
  void pass(const Side& from, const Side& to) const;

  Comm comm_;
  Side outgoing_, incoming_;
  PartsViews parts_;
};

}  // namespace corpuscle
