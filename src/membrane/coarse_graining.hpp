// Parameters of a membrane of few vertices that behaves as one of many (Equations 12 to 14), and the scaling between
// the dissipative-particle units of the model and physical ones (Equations 15 to 17).
#pragma once

namespace corpuscle {

/// Edge of an equilateral triangulation of `area_um2` by 2 vertices - 4 triangles, um.
double uniform_edge_length(double area_um2, int vertices);

/// Equation 13: angle between neighbouring triangles of a sphere of that many vertices, rad.
double spontaneous_angle(int vertices);

/// Equation 12: rest or contour length of the coarse network from that of the fine one.
double coarse_length(double fine_length, int fine_vertices, int coarse_vertices);

/// Equation 14: persistence length, which keeps p l0.
double coarse_persistence_length(double fine_persistence, double fine_l0, double coarse_l0);

/// Equation 14: coefficient of the power-law repulsion of exponent m.
double coarse_repulsion(double fine_coefficient, double fine_l0, double coarse_l0, double m = 2);

/// p l0 of links whose network has the given linear shear modulus, um2. @param kT_fJ  4.1e-6 at 23 degrees Celsius
double persistence_times_length(double shear_modulus_nN_per_um, double kT_fJ = 4.1e-6);

/// Model units against SI. A physical value is the model value times the factor. Equation 16 is printed the other way
/// round in Akerkouch & Le (2021).
struct DpdScaling {
  double diameter_SI = 7.82e-6, diameter_model = 8.06;  // D0, m
  double young_SI = 18.9e-6, young_model = 392.5;       // membrane Young's modulus, N/m
  double viscosity_SI = 6e-3, viscosity_model = 1.8;    // N s/m2
  double exponent = 1;                                  // alpha of Equation 17

  double length() const { return diameter_SI / diameter_model; }             // m, Equation 15
  double energy_per_area() const { return young_SI / young_model; }          // J/m2: k_a and k_d
  double energy() const { return energy_per_area() * length() * length(); }  // J, Equation 16
  double force() const { return energy_per_area() * length(); }              // N, Equation 16
  double energy_per_volume() const { return energy_per_area() / length(); }  // J/m3: k_v
  double time() const;                                                       // s, Equation 17
};

}  // namespace corpuscle
