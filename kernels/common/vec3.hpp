// A vector of three components for use inside kernels.
#pragma once

#include <Kokkos_Core.hpp>

#include <cmath>

namespace corpuscle {

template <class Real>
struct Vector3 {
  Real x = 0, y = 0, z = 0;

  KOKKOS_INLINE_FUNCTION Real& operator[](int d) { return d == 0 ? x : (d == 1 ? y : z); }
  KOKKOS_INLINE_FUNCTION Real operator[](int d) const { return d == 0 ? x : (d == 1 ? y : z); }

  KOKKOS_INLINE_FUNCTION Vector3& operator+=(const Vector3& b) {
    x += b.x, y += b.y, z += b.z;
    return *this;
  }
  KOKKOS_INLINE_FUNCTION Vector3& operator-=(const Vector3& b) {
    x -= b.x, y -= b.y, z -= b.z;
    return *this;
  }
  KOKKOS_INLINE_FUNCTION Vector3& operator*=(Real s) {
    x *= s, y *= s, z *= s;
    return *this;
  }

  // Friends, so that a number of another type converts.
  KOKKOS_INLINE_FUNCTION friend Vector3 operator+(Vector3 a, const Vector3& b) { return a += b; }
  KOKKOS_INLINE_FUNCTION friend Vector3 operator-(Vector3 a, const Vector3& b) { return a -= b; }
  KOKKOS_INLINE_FUNCTION friend Vector3 operator-(const Vector3& a) { return {-a.x, -a.y, -a.z}; }
  KOKKOS_INLINE_FUNCTION friend Vector3 operator*(Vector3 a, Real s) { return a *= s; }
  KOKKOS_INLINE_FUNCTION friend Vector3 operator*(Real s, Vector3 a) { return a *= s; }
};

using Vec3 = Vector3<double>;

template <class Real>
KOKKOS_INLINE_FUNCTION Vec3 to_double(const Vector3<Real>& a) {
  return {a.x, a.y, a.z};
}

KOKKOS_INLINE_FUNCTION double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
KOKKOS_INLINE_FUNCTION Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
KOKKOS_INLINE_FUNCTION double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }

/// Row e of a [entry, component] view.
template <class View>
KOKKOS_FORCEINLINE_FUNCTION Vector3<typename View::non_const_value_type> load(const View& view, int e) {
  return {view(e, 0), view(e, 1), view(e, 2)};
}

template <class View, class Real>
KOKKOS_FORCEINLINE_FUNCTION void store(const View& view, int e, const Vector3<Real>& a) {
  view(e, 0) = a.x;
  view(e, 1) = a.y;
  view(e, 2) = a.z;
}

}  // namespace corpuscle
