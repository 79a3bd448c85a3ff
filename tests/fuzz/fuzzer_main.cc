// SPDX-License-Identifier: Apache-2.0
// What libFuzzer calls: the target DLCS_FUZZ_TARGET.
#include <cstddef>
#include <cstdint>
#include <string>

#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dlcs::fuzz::DLCS_FUZZ_TARGET(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
