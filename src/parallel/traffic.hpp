// What a rank sends, counted for reports.
#pragma once

namespace corpuscle {

/// Of this process, from its start.
struct Traffic {
  long messages = 0, bytes = 0, reductions = 0;  // sent to other ranks; and how often all ranks have joined numbers

  void sent(long size) { ++messages, bytes += size; }
};

inline Traffic& traffic() {
  static Traffic all;
  return all;
}

}  // namespace corpuscle
