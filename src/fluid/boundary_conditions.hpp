// The six sides of the block: which condition holds where, and the velocities prescribed there.
#pragma once

#include "fluid/boundary.hpp"
#include "fluid/masked_gradient.hpp"
#include "grid/grid.hpp"
#include "grid/wall_sides.hpp"

#include <string>

namespace corpuscle {

/// What the velocities of an inlet or moving wall are multiplied with at time t, us: linear between the ends of its ramp
/// and the rows of its table, constant beyond.
double time_factor(const BoundarySettings& settings, double t);

/// Which sides are walls, at rest or moving.
WallSides walls_of(const std::vector<BoundarySettings>& boundaries);

class BoundaryConditions {
 public:
  /// @param settings  one entry per side (periodic sides included); the reader has checked that none is missing
  BoundaryConditions(Grid& grid, const std::vector<BoundarySettings>& settings, const GridSettings* shape);

  /// Prescribed velocities at time t, us.
  void set_time(double t);
  /// Fill the boundary layer of u, halos included, from its fluid cells (whose halos are up to date).
  void fill(const Components<double>& u) const { fill_sides(u, false); }
  /// The same with all prescribed velocities zero: the boundary's part of the linear operator.
  void fill_homogeneous(const Components<float>& u) const { fill_sides(u, true); }
  /// Zero where fill_homogeneous() may have put something else.
  void clear_natural(const Components<float>& u) const;

  /// No flux through moving walls: on a curved one the velocity given at a face's centre is not quite along it.
  void close_moving_walls(const Array<double> (&flux)[3]) const;
  /// Where there is no outflow, the inlets must carry exactly `growth` (um3/us, of the bodies inside) out of the block.
  /// Spreads what is missing evenly over them and returns it over their area, um/us. @pre has_inlet()
  double balance(const Array<double> (&flux)[3], double growth) const;

  /// [cell] 1 at boundary nodes of outflow sides, where pressure is given.
  const PressureMask& outflow() const { return outflow_; }
  bool has_outflow() const { return has_outflow_; }
  bool has_inlet() const { return has_inlet_; }
  /// [direction][low, high] sides with a condition on the velocity's derivative: outflow and symmetry.
  const bool (&natural() const)[3][2] { return natural_; }
  /// Largest prescribed speed at any time, um/us.
  double largest_speed() const { return largest_speed_; }
  /// Prescribed velocity at boundary nodes, [cell, 3] um/us; allocated only if some side prescribes one.
  const Components<double>& given() const { return given_; }
  /// What bounds the fluid at this side so that no surface may come near: "a wall", "an inlet", "a symmetry side"; "" for the
  /// others (for the immersed boundary's guard).
  std::string bounded_by(int side) const;

 private:
  struct Side {
    BoundarySettings settings;
    int number = 0;      // its entry in the case
    int d = 0, end = 0;  // direction, and 0 for its low end or 1 for its high end
    bool here = false;   // this rank touches it
    CellBox box;         // boundary nodes, halo included
    CellBox inner;       // the same without the edges of the block
    int inward = 0;      // padded offset from a boundary node to the cell beside it
    int to_face = 0;     // padded offset from a boundary node to the index of its face
    CellBox faces;       // owned faces of the side
  };
  void set_prescribed();
  void set_profile(const Side& side, const GridSettings* shape);
  void check_parabolic(const Side& side, bool box, const Triple& centre, double radius) const;
  template <class Velocity>
  void fill_sides(const Velocity& u, bool homogeneous) const;

  Grid* grid_;
  BoundarySettings::Type types_[6] = {};
  std::vector<Side> sides_;  // in the order in which they are filled: walls last, so that they win at edges
  GivenBoxes given_boxes_;
  PressureMask outflow_;
  Components<double> profile_, given_;
  bool has_outflow_ = false, has_inlet_ = false, prescribed_ = false, natural_[3][2] = {};
  double largest_speed_ = 0;
};

}  // namespace corpuscle
