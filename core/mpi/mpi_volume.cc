// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/mpi_volume.h"

#include <mpi.h>

#include <numeric>

namespace dlcs {
namespace {

MpiVolume volume_of_mpi;

double Bytes(int count, MPI_Datatype type) {
  int size = 0;
  PMPI_Type_size(type, &size);
  return static_cast<double>(count) * size;
}

void CountMessage(int count, MPI_Datatype type) {
  volume_of_mpi.messages += 1;
  volume_of_mpi.message_bytes += Bytes(count, type);
}

void CountCollective(int count, MPI_Datatype type) {
  volume_of_mpi.collectives += 1;
  volume_of_mpi.collective_bytes += Bytes(count, type);
}

}  // namespace

const MpiVolume& VolumeOfMpi() { return volume_of_mpi; }

}  // namespace dlcs

extern "C" {

int MPI_Send(const void* data, int count, MPI_Datatype type, int to, int tag, MPI_Comm communicator) {
  dlcs::CountMessage(count, type);
  return PMPI_Send(data, count, type, to, tag, communicator);
}

int MPI_Isend(const void* data, int count, MPI_Datatype type, int to, int tag, MPI_Comm communicator,
              MPI_Request* request) {
  dlcs::CountMessage(count, type);
  return PMPI_Isend(data, count, type, to, tag, communicator, request);
}

int MPI_Irsend(const void* data, int count, MPI_Datatype type, int to, int tag, MPI_Comm communicator,
               MPI_Request* request) {
  dlcs::CountMessage(count, type);
  return PMPI_Irsend(data, count, type, to, tag, communicator, request);
}

int MPI_Bcast(void* data, int count, MPI_Datatype type, int from, MPI_Comm communicator) {
  int rank = 0;
  PMPI_Comm_rank(communicator, &rank);
  if (rank == from) {
    dlcs::volume_of_mpi.broadcasts += 1;
    dlcs::volume_of_mpi.broadcast_bytes += dlcs::Bytes(count, type);
  }
  return PMPI_Bcast(data, count, type, from, communicator);
}

int MPI_Allgather(const void* mine, int count, MPI_Datatype type, void* all, int all_count, MPI_Datatype all_type,
                  MPI_Comm communicator) {
  dlcs::CountCollective(count, type);
  return PMPI_Allgather(mine, count, type, all, all_count, all_type, communicator);
}

int MPI_Allgatherv(const void* mine, int count, MPI_Datatype type, void* all, const int all_counts[],
                   const int places[], MPI_Datatype all_type, MPI_Comm communicator) {
  dlcs::CountCollective(count, type);
  return PMPI_Allgatherv(mine, count, type, all, all_counts, places, all_type, communicator);
}

int MPI_Allreduce(const void* mine, void* all, int count, MPI_Datatype type, MPI_Op operation, MPI_Comm communicator) {
  dlcs::CountCollective(count, type);
  return PMPI_Allreduce(mine, all, count, type, operation, communicator);
}

int MPI_Alltoall(const void* mine, int count, MPI_Datatype type, void* all, int all_count, MPI_Datatype all_type,
                 MPI_Comm communicator) {
  int size = 0;
  PMPI_Comm_size(communicator, &size);
  dlcs::CountCollective(count * size, type);
  return PMPI_Alltoall(mine, count, type, all, all_count, all_type, communicator);
}

int MPI_Alltoallv(const void* mine, const int counts[], const int places[], MPI_Datatype type, void* all,
                  const int all_counts[], const int all_places[], MPI_Datatype all_type, MPI_Comm communicator) {
  int size = 0;
  PMPI_Comm_size(communicator, &size);
  dlcs::CountCollective(std::accumulate(counts, counts + size, 0), type);
  return PMPI_Alltoallv(mine, counts, places, type, all, all_counts, all_places, all_type, communicator);
}

int MPI_Scan(const void* mine, void* all, int count, MPI_Datatype type, MPI_Op operation, MPI_Comm communicator) {
  dlcs::CountCollective(count, type);
  return PMPI_Scan(mine, all, count, type, operation, communicator);
}

}  // extern "C"
