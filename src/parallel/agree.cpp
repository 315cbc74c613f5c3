#include "parallel/agree.hpp"

#ifdef CORPUSCLE_MPI
#include <chrono>
#include <thread>
#endif

namespace corpuscle {

#ifdef CORPUSCLE_MPI

namespace {

bool finished(MPI_Request& request) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(patience_s);
  for (int done = 0; Clock::now() < end; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done) return true;
  }
  return false;
}

}  // namespace

std::string agree(const Comm& comm, const std::string& failure) {
  if (comm.size() == 1) return failure;
  const int mine = failure.empty() ? comm.size() : comm.rank();
  int lowest = comm.size();
  MPI_Request request;
  MPI_Iallreduce(&mine, &lowest, 1, MPI_INT, MPI_MIN, comm.handle(), &request);
  if (failure.empty())
    MPI_Wait(&request, MPI_STATUS_IGNORE);
  else if (!finished(request))
    return failure;
  if (lowest == comm.size()) return "";
  std::string first = failure;
  unsigned long length = first.size();
  MPI_Bcast(&length, 1, MPI_UNSIGNED_LONG, lowest, comm.handle());
  first.resize(length);
  MPI_Bcast(first.data(), static_cast<int>(length), MPI_CHAR, lowest, comm.handle());
  return first;
}

bool all_here(const Comm& comm) {
  if (comm.size() == 1) return true;
  MPI_Request request;
  MPI_Ibarrier(comm.handle(), &request);
  return finished(request);
}

#else

std::string agree(const Comm&, const std::string& failure) { return failure; }
bool all_here(const Comm&) { return true; }

#endif

}  // namespace corpuscle
