// The smooth surfaces that meshes are generated on.
#pragma once

#include <cmath>
#include <vector>

#include "common/vec3.hpp"
#include "input/case.hpp"

namespace corpuscle {

/// A smooth closed surface, star-like enough that a sphere's latitude and longitude describe it.
class SurfaceShape {
 public:
  virtual ~SurfaceShape() = default;

  /// Point of the surface for a direction of the unit sphere, such that equal areas of the sphere go to equal areas of
  /// the surface as far as latitude is concerned.
  virtual Vec3 from_sphere(const Vec3& direction) const = 0;

  /// Closest point of the surface to a point near it.
  virtual Vec3 project(const Vec3& point) const = 0;

  double area() const { return area_; }
  double volume() const { return volume_; }

 protected:
  double area_ = 0, volume_ = 0;
};

/// A body of revolution about z given by its meridian (r, z)(phi), 0 <= phi <= pi from the upper pole to the lower.
class RevolvedShape : public SurfaceShape {
 public:
  Vec3 from_sphere(const Vec3& direction) const override;
  Vec3 project(const Vec3& point) const override;

  /// The direction that from_sphere() takes to the point of the surface closest to `point`.
  Vec3 to_sphere(const Vec3& point) const;

 protected:
  struct Latitude {
    double sin, cos;  // of phi
  };
  struct Meridian {
    double r, z, dr, dz, ddr, ddz;  // and first and second derivatives to phi
  };
  virtual Meridian meridian(const Latitude& latitude) const = 0;

  /// Tabulate the area above each phi; to be called by the constructor of the final class.
  void tabulate();

 private:
  Latitude closest(double r, double z) const;
  static Latitude latitude(double phi) { return {std::sin(phi), std::cos(phi)}; }
  static Latitude turned(const Latitude& from, double angle);

  std::vector<double> share_;   // [entry] share of the area above phi = pi entry / (entries - 1)
  std::vector<Latitude> seen_;  // [entry] where the ray with 1 - z / (|z| + r) = 2 entry / (entries - 1) meets the surface
};

/// Equation 1: z = +-D0 sqrt(1 - 4 q) (a0 + a1 q + a2 q^2), q = (r/D0)^2, with r = D0/2 sin(phi).
class BiconcaveShape final : public RevolvedShape {
 public:
  static constexpr double D0 = 7.82, a0 = 0.0518, a1 = 2.0026, a2 = -4.491;
  BiconcaveShape() { tabulate(); }

 protected:
  Meridian meridian(const Latitude& latitude) const override;
};

class EllipsoidShape final : public SurfaceShape {
 public:
  explicit EllipsoidShape(const Triple& semi_axes);
  Vec3 from_sphere(const Vec3& direction) const override;
  Vec3 project(const Vec3& point) const override;

 private:
  Vec3 axes_;
  std::vector<double> share_;  // [entry] share of the area above cos(latitude) = 1 - 2 entry / (entries - 1)
};

}  // namespace corpuscle
