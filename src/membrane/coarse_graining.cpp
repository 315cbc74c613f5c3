#include "membrane/coarse_graining.hpp"

#include <cmath>

#include "membrane/spring_law.hpp"

namespace corpuscle {

double uniform_edge_length(double area_um2, int vertices) { return std::sqrt(4 * area_um2 / (std::sqrt(3.0) * (2.0 * vertices - 4))); }

double spontaneous_angle(int vertices) {
  constexpr double pi = 3.14159265358979323846;
  const double s = std::sqrt(3.0) * (vertices - 2);
  return std::acos((s - 5 * pi) / (s - 3 * pi));
}

double coarse_length(double fine_length, int fine_vertices, int coarse_vertices) {
  return fine_length * std::sqrt((fine_vertices - 2.0) / (coarse_vertices - 2.0));
}

double coarse_persistence_length(double fine_persistence, double fine_l0, double coarse_l0) {
  return fine_persistence * fine_l0 / coarse_l0;
}

double coarse_repulsion(double fine_coefficient, double fine_l0, double coarse_l0, double m) {
  return fine_coefficient * std::pow(coarse_l0 / fine_l0, m + 1);
}

double persistence_times_length(double shear_modulus_nN_per_um, double kT_fJ) {
  return kT_fJ * shear_modulus_over_stiffness() / shear_modulus_nN_per_um;
}

double DpdScaling::time() const { return std::pow(length() * (viscosity_SI / viscosity_model) / energy_per_area(), exponent); }

}  // namespace corpuscle
