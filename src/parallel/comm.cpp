#include "parallel/comm.hpp"

namespace corpuscle {

#ifdef CORPUSCLE_MPI

void Comm::sum(double* values, int n) const {
  if (size_ > 1) MPI_Allreduce(MPI_IN_PLACE, values, n, MPI_DOUBLE, MPI_SUM, comm_);
}
void Comm::max(double* values, int n) const {
  if (size_ > 1) MPI_Allreduce(MPI_IN_PLACE, values, n, MPI_DOUBLE, MPI_MAX, comm_);
}
long Comm::sum(long value) const {
  if (size_ > 1) MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_LONG, MPI_SUM, comm_);
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

void Comm::sum(double*, int) const {}
void Comm::max(double*, int) const {}
long Comm::sum(long value) const { return value; }
void Comm::barrier() const {}
void Comm::broadcast(std::string&) const {}

#endif

}  // namespace corpuscle
