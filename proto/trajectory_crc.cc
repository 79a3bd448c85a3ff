// SPDX-License-Identifier: Apache-2.0
#include "proto/trajectory_crc.h"

#include <zlib.h>

#include <bit>

namespace dlcs {

std::uint32_t TrajectoryCrc(const v1::TrajectoryChunk& chunk) {
  static_assert(std::endian::native == std::endian::little, "doubles are taken as they stand in memory");
  uLong crc = 0;
  for (const auto* values : {&chunk.times(), &chunk.x(), &chunk.y()}) {
    crc =
        crc32(crc, reinterpret_cast<const Bytef*>(values->data()), static_cast<uInt>(values->size() * sizeof(double)));
  }
  return static_cast<std::uint32_t>(crc);
}

}  // namespace dlcs
