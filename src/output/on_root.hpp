// Work that rank 0 does for all, with its failure felt by all.
#pragma once

#include <string>

#include "core/error.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

/// Run `work` on rank 0; if it throws InputError or ComputationError, every rank throws the same.
template <class Work>
void on_root(const Comm& comm, const Work& work) {
  std::string failure;  // first letter: which kind
  if (comm.root()) {
    try {
      work();
    } catch (const InputError& error) {
      failure = std::string("I") + error.what();
    } catch (const ComputationError& error) {
      failure = std::string("C") + error.what();
    }
  }
  comm.broadcast(failure);
  if (failure.empty()) return;
  if (failure[0] == 'I') throw InputError(failure.substr(1));
  throw ComputationError(failure.substr(1));
}

}  // namespace corpuscle
