// A checksum of an array that does not depend on how it is cut over ranks: each entry is hashed with its place, and the
// hashes are added.
#pragma once

#ifdef CORPUSCLE_HDF5

#include <cstdint>
#include <cstring>

#include "output/hdf5_file.hpp"

namespace corpuscle {

/// Of 8-byte entries, over the box `part` of an array of `shape`; parts add up modulo 2^32. The finaliser is that of
/// splitmix64 (Steele, Lea and Flood 2014).
template <class T>
std::uint32_t checksum(const Shape& shape, const Slab& part, const T* values) {
  static_assert(sizeof(T) == 8);
  hsize_t count = 1;
  for (const auto n : part.count) count *= n;
  std::uint32_t sum = 0;
  for (hsize_t e = 0; e < count; ++e) {
    hsize_t rest = e, place = 0, stride = 1;
    for (std::size_t d = shape.size(); d-- > 0;) {
      place += (part.offset[d] + rest % part.count[d]) * stride;
      rest /= part.count[d];
      stride *= shape[d];
    }
    std::uint64_t z;
    std::memcpy(&z, values + e, 8);
    z += 0x9e3779b97f4a7c15u * (place + 1);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    sum += static_cast<std::uint32_t>(z >> 32);
  }
  return sum;
}

inline Slab whole_of(const Shape& shape) { return {Shape(shape.size(), 0), shape}; }

}  // namespace corpuscle

#endif
