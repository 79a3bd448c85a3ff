// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_PROTO_WIRE_TRAJECTORY_CRC_H_
#define DLCS_PROTO_WIRE_TRAJECTORY_CRC_H_

#include <cstdint>

#include "dlcs/v1/solver.pb.h"

namespace dlcs {

// CRC-32 (zlib's) of times, x and y as little-endian doubles, in this order: TrajectoryPage.crc32; of w:
// w_crc32; and of the outputs: outputs_crc32.
std::uint32_t TrajectoryCrc(const v1::TrajectoryChunk& chunk);
std::uint32_t TrajectoryWCrc(const v1::TrajectoryChunk& chunk);
std::uint32_t TrajectoryOutputsCrc(const v1::TrajectoryChunk& chunk);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_TRAJECTORY_CRC_H_
