// What a rank sends, counted for reports. Without what hypre sends by itself.
#pragma once

namespace corpuscle {

/// Of this process, from its start.
struct Traffic {
  long messages = 0, bytes = 0, reductions = 0;  // sent to other ranks; and how often all ranks have waited for each other's numbers

  void sent(long size) { ++messages, bytes += size; }
};

inline Traffic& traffic() {
  static Traffic all;
  return all;
}

}  // namespace corpuscle
