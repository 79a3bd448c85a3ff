// SPDX-License-Identifier: Apache-2.0
// What a process has handed to MPI.

#ifndef DLCS_CORE_MPI_MPI_VOLUME_H_
#define DLCS_CORE_MPI_MPI_VOLUME_H_

namespace dlcs {

// Counted where MPI is called, by this library and by multigrid alike: calls of these functions go through ours, which
// MPI calls its profiling interface.
struct MpiVolume {
  double messages = 0, message_bytes = 0;        // to single ranks
  double broadcasts = 0, broadcast_bytes = 0;    // as the one that has the values
  double collectives = 0, collective_bytes = 0;  // sums, maxima, gathered and exchanged values

  // Whether values of a rank went to others since then: they share work.
  bool SharesMoreThan(const MpiVolume& before) const {
    return messages + broadcasts > before.messages + before.broadcasts;
  }
};

// Of this process so far; not while another thread calls MPI.
const MpiVolume& VolumeOfMpi();

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_MPI_VOLUME_H_
