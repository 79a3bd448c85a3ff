// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/trajectory_crc.h"

#include <zlib.h>

#include <bit>
#include <initializer_list>

namespace dlcs {
namespace {

std::uint32_t Crc(std::initializer_list<const google::protobuf::RepeatedField<double>*> lists) {
  static_assert(std::endian::native == std::endian::little, "doubles are taken as they stand in memory");
  uLong crc = 0;
  for (const auto* values : lists) {
    crc =
        crc32(crc, reinterpret_cast<const Bytef*>(values->data()), static_cast<uInt>(values->size() * sizeof(double)));
  }
  return static_cast<std::uint32_t>(crc);
}

}  // namespace

std::uint32_t TrajectoryCrc(const v1::TrajectoryChunk& chunk) { return Crc({&chunk.times(), &chunk.x(), &chunk.y()}); }

std::uint32_t TrajectoryWCrc(const v1::TrajectoryChunk& chunk) { return Crc({&chunk.w()}); }

std::uint32_t TrajectoryOutputsCrc(const v1::TrajectoryChunk& chunk) { return Crc({&chunk.outputs()}); }

}  // namespace dlcs
