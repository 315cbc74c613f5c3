#include "parallel/comm.hpp"

#include "common/extremes.hpp"
#include "parallel/traffic.hpp"

namespace corpuscle {

#ifdef CORPUSCLE_MPI

namespace {

void keep_larger(void* from, void* into, int* n, MPI_Datatype*) {
  const double* a = static_cast<const double*>(from);
  double* b = static_cast<double*>(into);
  for (int i = 0; i < *n; ++i) b[i] = larger(a[i], b[i]);
}

/// MPI_MAX leaves open what becomes of numbers that are none.
MPI_Op keeping_max() {
  static const MPI_Op op = [] {
    MPI_Op made;
    MPI_Op_create(keep_larger, 1, &made);
    return made;
  }();
  return op;
}

}  // namespace

Comm Comm::alone() { return Comm(MPI_COMM_SELF); }

void Comm::sum(double* values, int n) const {
  if (size_ == 1) return;
  ++traffic().reductions;
  MPI_Allreduce(MPI_IN_PLACE, values, n, MPI_DOUBLE, MPI_SUM, comm_);
}
void Comm::max(double* values, int n) const {
  if (size_ == 1) return;
  ++traffic().reductions;
  MPI_Allreduce(MPI_IN_PLACE, values, n, MPI_DOUBLE, keeping_max(), comm_);
}
long Comm::sum(long value) const {
  if (size_ == 1) return value;
  ++traffic().reductions;
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_LONG, MPI_SUM, comm_);
  return value;
}
void Comm::barrier() const {
  if (size_ > 1) MPI_Barrier(comm_);
}
void Comm::broadcast(std::string& text) const {
  if (size_ == 1) return;
  unsigned long length = text.size();
  MPI_Bcast(&length, 1, MPI_UNSIGNED_LONG, 0, comm_);
  text.resize(length);
  MPI_Bcast(text.data(), static_cast<int>(length), MPI_CHAR, 0, comm_);
}

#else

Comm Comm::alone() { return Comm(); }

void Comm::sum(double*, int) const {}
void Comm::max(double*, int) const {}
long Comm::sum(long value) const { return value; }
void Comm::barrier() const {}
void Comm::broadcast(std::string&) const {}

#endif

}  // namespace corpuscle
