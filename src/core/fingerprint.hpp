// A 64-bit fingerprint of bytes, by which a later run knows them again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace corpuscle {

/// FNV-1a (Fowler, Noll and Vo): each step is one to one, so that a single byte that differs is always told. No cipher.
class Fingerprint {
 public:
  void add(const void* data, std::size_t bytes) {
    const auto* byte = static_cast<const unsigned char*>(data);
    for (std::size_t n = 0; n < bytes; ++n) value_ = (value_ ^ byte[n]) * 0x100000001b3u;
  }
  /// With its length, so that texts in a row cannot be cut elsewhere.
  void add(const std::string& text) {
    const std::uint64_t size = text.size();
    add(&size, sizeof size);
    add(text.data(), text.size());
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace corpuscle
