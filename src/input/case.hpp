// A scene as the program sees it: every value checked and in internal units (um, us, pg). A section that the case
// file leaves out is an empty optional or vector here, and the module it stands for is never built.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace corpuscle {

using Triple = std::array<double, 3>;

/// [time]
struct TimeSettings {
  double step_us = 1;
  double end_us = 0;
  double first_step_us = 0;           // the first steps are this long at most; 0: step_us
  double stop_before_outflow_um = 3;  // the run ends when a cell is this near to an outflow, along the grid line

  bool operator==(const TimeSettings&) const = default;
};

/// [grid]
struct GridSettings {
  enum class Generator { box, straight_tube, swept_tube, file };
  enum class CrossSection { conformal, elliptical };
  enum class Centerline { arc, helix, spline };

  Generator generator = Generator::box;
  std::array<int, 3> nodes{};     // nodes per direction, one more than cells
  Triple lower_um{}, upper_um{};  // box
  double diameter_um = 0;         // tubes
  double length_um = 0;           // straight tube: along z, centred at the origin
  CrossSection cross_section = CrossSection::conformal;
  Centerline centerline = Centerline::spline;  // swept tube
  std::vector<Triple> points_um;               // spline: points the centreline passes through
  double arc_radius_um = 0, arc_angle_deg = 0;
  double helix_radius_um = 0, helix_pitch_um = 0, helix_turns = 0;
  std::string file;  // HDF5 with data set "nodes" [nk, nj, ni, 3] in um

  bool operator==(const GridSettings&) const = default;
};

/// [fluid]
struct FluidSettings {
  enum class Convection { none, extrapolated, implicit };

  double density_pg_per_um3 = 1.0;
  double kinematic_viscosity_um2_per_us = 1.1;
  Convection convection = Convection::extrapolated;
  double momentum_tolerance = 1e-6;      // relative residual; 1e-5 moves a cell by less than 1e-5 um in 300 us
  double divergence_tolerance = 5e-11;   // face-flux divergence over U h^2
  int max_iterations = 500;              // of either linear solver
  bool repeat_projection = true;         // no key: see FluidSolver::solve
  Triple pressure_gradient_Pa_per_um{};  // imposed on periodic directions, in Pa/um; drives the flow along -gradient

  bool operator==(const FluidSettings&) const = default;
};

/// [[boundary]]: one per side of the block
struct BoundarySettings {
  enum class Side { i_min, i_max, j_min, j_max, k_min, k_max };
  enum class Type { velocity_inlet, outflow, wall, moving_wall, symmetry, periodic };
  enum class Profile { uniform, parabolic, table };

  Side side = Side::i_min;
  Type type = Type::wall;
  Profile profile = Profile::uniform;
  double speed = 0;                                 // um/us, inlet: mean speed along the inward normal of the side
  std::optional<Triple> velocity;                   // um/us, inlet or moving wall: a fixed vector instead of `speed`
  std::vector<std::array<double, 2>> radial_table;  // profile = "table": (r / R, speed / mean speed)
  double ramp_us = 0;                               // linear from rest
  std::vector<std::array<double, 2>> time_table;    // (us, factor), linear between, constant beyond

  bool operator==(const BoundarySettings&) const = default;
};

/// [[cells]], with what its type says
struct CellSettings {
  enum class Shape { biconcave, sphere, ellipsoid };
  enum class Law { wlc_pow, neo_hookean, skalak };
  enum class Reference { shape, spontaneous_angle, uniform, spheroid };
  enum class Interior { empty, cytosol };
  enum class Dissipation { central, full };

  int type = -1;  // of Case::cell_types; -1: all keys are in place
  int vertices = 500;
  Shape shape = Shape::biconcave;  // unless there is a mesh
  double diameter_um = 7.82;       // biconcave
  double radius_um = 0;            // sphere
  Triple semi_axes_um{};           // ellipsoid
  std::string mesh;                // OFF or STL file instead of a built-in shape; "" if none
  double scale = 1;                // mesh: um per unit of the file
  bool recenter = true;            // mesh: center_um is the centroid of its volume; false: the file's origin
  bool align = true;               // mesh: if it is a disc, its own axis is the symmetry axis; false: the file's z
  Triple center_um{};              // of the cell's volume
  Triple axis{0, 0, 1};            // direction of the cell's symmetry axis
  double spin_deg = 0;             // rotation of the mesh about that axis
  Triple start_stretch{1, 1, 1};   // by which the cell starts drawn out along its own axes, with its volume kept
  Triple push_nN{};                // on the cell from outside, the same share on each vertex
  double mass_pg = 100;
  Law law = Law::wlc_pow;
  double skalak_c = 1;  // skalak: modulus of area = shear modulus (1 + 2 C)
  Reference reference = Reference::shape;
  double reference_reduced_volume = 0.95;  // spheroid: 6 sqrt(pi) V / A^(3/2) of the shape that the sheet rests on
  double inflation = 0;                    // sphere: radius over that at which the sheet rests, less 1
  Interior interior = Interior::empty;
  double viscosity_ratio = 1;                 // of the fluid inside over that outside; 1 unless membranes are forces
  double shear_modulus_uN_per_m = 6.32;       // at small strains, of any law
  double bending_modulus_fJ = 2.4e-4;         // kappa; k_b = 2 kappa / sqrt(3)
  double area_modulus_uN_per_m = 236;         // k_a; for sheets (neo_hookean, skalak) a case's default is 0 for both
  double local_area_modulus_uN_per_m = 4.82;  // k_d
  double volume_modulus_Pa = 248;             // k_v
  double membrane_viscosity_N_s_per_m = 0;
  Dissipation dissipation = Dissipation::central;

  bool operator==(const CellSettings&) const = default;
};

/// [[cell_types]]
struct CellTypeSettings {
  std::string name;
  CellSettings cell;  // of its cells, but for their places

  bool operator==(const CellTypeSettings&) const = default;
};

/// A key of the section that a cell's constants are in, for messages: "cell_types.0.vertices", or "cells.vertices" where all
/// keys are in place.
inline std::string constant_key(const CellSettings& cell, const std::string& key) {
  return (cell.type < 0 ? "cells." : "cell_types." + std::to_string(cell.type) + ".") + key;
}

/// [[populations]]: cells of one type that the program places
struct PopulationSettings {
  enum class Orientation { random, aligned };

  int type = 0;           // of Case::cell_types
  double hematocrit = 0;  // share of the fluid's volume; 0: count says how many
  int count = 0;          // 0: as many as the hematocrit asks for
  int seed = 1;
  double gap_um = 0.1;  // least, of its cells to any other surface at the start
  Orientation orientation = Orientation::random;
  Triple axis{0, 0, 1};                      // aligned: direction of the cells' symmetry axes
  std::optional<Triple> lower_um, upper_um;  // box within which its cells start

  bool operator==(const PopulationSettings&) const = default;
};

/// [[bodies]]: rigid, held or moved as prescribed
struct BodySettings {
  enum class Shape { sphere, ellipsoid, file };

  Shape shape = Shape::sphere;
  int vertices = 0;  // surface resolution; 0: about one grid spacing an edge
  double radius_um = 0;
  Triple semi_axes_um{};
  std::string file;       // OFF or STL
  double scale = 1;       // file: um per unit of the file
  bool recenter = false;  // file: center_um is the centroid of its volume; false: the file's origin
  Triple center_um{};     // of a sphere or ellipsoid; for a file see recenter
  Triple axis{0, 0, 1};   // ellipsoid, file: where its own z axis points
  double spin_deg = 0;    // ellipsoid, file: rotation about that axis
  Triple velocity_um_per_us{};
  Triple angular_velocity_rad_per_us{};  // about center_um

  bool operator==(const BodySettings&) const = default;
};

/// [coupling]
struct CouplingSettings {
  enum class Scheme { robin, iterated, loose, force };
  enum class Acceleration { anderson, aitken };
  enum class Kernel { three_point, four_point };
  enum class Pressure { spread, sharp };

  Scheme scheme = Scheme::robin;
  double tolerance = 1e-3;                   // iterated: residual over the step's displacement
  int max_iterations = 200;                  // iterated
  std::optional<Acceleration> acceleration;  // iterated; by default Anderson's with a Robin term, Aitken's without
  double robin_coefficient = -1;             // beta, pg/um2/us; negative: pi mu / h (see MembraneCoupling::stability)
  bool robin_in_iterated = true;
  Kernel kernel = Kernel::three_point;   // force
  bool slip = true;                      // force
  Pressure pressure = Pressure::spread;  // force: whether what is normal to membranes is spread, or jumps

  bool operator==(const CouplingSettings&) const = default;
};

/// [contact], between membranes that are forces
struct ContactSettings {
  double range_um = 0.25;
  double pressure = 0.02;         // kPa, at half the range: 0.5 nN on 25 um2, about what presses red cells
  double aggregation_energy = 0;  // fJ/um2
  double aggregation_range_um = 0.5;

  bool operator==(const ContactSettings&) const = default;
};

/// [blood]: what is measured of many cells in a flow
struct BloodSettings {
  double from_us = 0;          // sampling begins
  double sample_every_us = 0;  // 0: ten times time.step_us
  int bins = 0;                // of profiles; 0: about a spacing wide
  double layer_window_um = 1;  // length of the windows in which the outermost membrane is looked for

  /// Of samples, a fixed time, whatever steps there are: means are over time. No more often than whole steps are: the first ones, which
  /// may be shorter, would count for more.
  double interval_us(double step_us) const {
    constexpr double seldom = 10;  // steps: neighbouring ones tell the same, and a sample costs some hundredths of a step
    return sample_every_us > 0 ? std::max(sample_every_us, step_us) : seldom * step_us;
  }

  bool operator==(const BloodSettings&) const = default;
};

/// [stretching]: a cell pulled by two opposite forces, no fluid
struct StretchingSettings {
  double force_pN = 200;
  int steps = 16;
  double patch_fraction = 0.02;  // share of the vertices at each end that carry the force
  double tolerance = 1e-4;       // rest: largest residual vertex force over the mean applied vertex force
  int max_iterations = 200000;   // of the relaxation, each force step
  std::string experiment;        // CSV to compare with; "" if none

  bool operator==(const StretchingSettings&) const = default;
};

/// [output]
struct OutputSettings {
  double every_us = 0;             // fields and cells; 0: only the first and last state
  double history_every_us = 0;     // 0: every step
  double checkpoint_every_us = 0;  // 0: only at the end
  bool fields = true;              // false, or a list in the case file: which are written
  bool velocity = true, pressure = true, kind = true;
  bool wall_shear_stress = false;  // a field
  bool cells = true;
  int cells_in_history = 16;  // up to so many cells each has lines in the history

  bool operator==(const OutputSettings&) const = default;
};

struct Case {
  std::string path;  // of the case file
  std::string title;
  std::string resolved;                     // every key with the value used, as TOML; stored with the results
  std::vector<std::string> without_effect;  // keys among those that mean nothing in this scene
  std::vector<std::string> remarks;         // on keys that are given and have no effect
  TimeSettings time;
  std::optional<GridSettings> grid;
  std::optional<FluidSettings> fluid;
  std::vector<BoundarySettings> boundaries;
  std::vector<CellTypeSettings> cell_types;
  std::vector<CellSettings> cells;
  std::vector<PopulationSettings> populations;
  std::vector<BodySettings> bodies;
  std::optional<CouplingSettings> coupling;
  std::optional<ContactSettings> contact;
  std::optional<BloodSettings> blood;
  std::optional<StretchingSettings> stretching;
  OutputSettings output;

  bool has_cells() const { return !cells.empty() || !populations.empty(); }
};

/// Read and check a case file.
/// @param overrides  "section.key=value" as given to --set; "cells.0.vertices=1000" addresses the first [[cells]].
/// @throws InputError  naming file, line, key, value and what is allowed.
Case read_case(const std::string& path, const std::vector<std::string>& overrides = {});

}  // namespace corpuscle
