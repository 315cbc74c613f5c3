// Messages of any length between any ranks, where only the sender knows that there is one.
#pragma once

#include <algorithm>
#include <map>
#include <vector>

#include "parallel/comm.hpp"

namespace corpuscle {

/// Bytes by rank.
using Parcels = std::map<int, std::vector<char>>;

/// Every rank calls with what it has for others (and itself). @returns what it gets, by sender
Parcels exchange_parcels(const Comm& comm, const Parcels& outgoing);

/// Appends an object's bytes, and takes them off again.
template <class T>
void put(std::vector<char>& bytes, const T* values, std::size_t count) {
  const char* from = reinterpret_cast<const char*>(values);
  bytes.insert(bytes.end(), from, from + count * sizeof(T));
}
template <class T>
std::size_t take(const std::vector<char>& bytes, std::size_t at, T* values, std::size_t count) {
  const std::size_t length = count * sizeof(T);
  std::copy(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.begin() + static_cast<std::ptrdiff_t>(at + length),
            reinterpret_cast<char*>(values));
  return at + length;
}

}  // namespace corpuscle
