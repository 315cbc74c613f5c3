#include "parallel/parcels.hpp"

#include "core/error.hpp"
#include "parallel/traffic.hpp"

namespace corpuscle {

Parcels exchange_parcels(const Comm& comm, const Parcels& outgoing) {
  Parcels incoming;
  if (const auto own = outgoing.find(comm.rank()); own != outgoing.end()) incoming[comm.rank()] = own->second;
#ifdef CORPUSCLE_MPI
  if (comm.size() == 1) return incoming;
  constexpr int tag = 71;
  constexpr std::size_t most = 2147483647;
  double too_long = 0;
  std::vector<int> sent(comm.size(), 0), received(comm.size(), 0);
  for (const auto& [rank, bytes] : outgoing) {
    if (bytes.size() > most) too_long = 1;
    if (rank != comm.rank()) sent[rank] = static_cast<int>(bytes.size());
  }
  if (comm.max(too_long) > 0) throw ComputationError("cells: a message between two ranks has more than 2 GB: use more ranks");
  ++traffic().reductions;
  MPI_Alltoall(sent.data(), 1, MPI_INT, received.data(), 1, MPI_INT, comm.handle());
  std::vector<MPI_Request> requests;
  for (int rank = 0; rank < comm.size(); ++rank) {
    if (received[rank] == 0) continue;
    auto& bytes = incoming[rank];
    bytes.resize(received[rank]);
    MPI_Irecv(bytes.data(), received[rank], MPI_BYTE, rank, tag, comm.handle(), &requests.emplace_back());
  }
  for (const auto& [rank, bytes] : outgoing)
    if (rank != comm.rank() && !bytes.empty()) {
      traffic().sent(sent[rank]);
      MPI_Isend(bytes.data(), sent[rank], MPI_BYTE, rank, tag, comm.handle(), &requests.emplace_back());
    }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
#endif
  return incoming;
}

}  // namespace corpuscle
