// SPDX-License-Identifier: Apache-2.0
// Systems as people write them: networks, machines and loads, most of them at rest or symmetric, so that some component
// is zero, small, or the difference of large ones. Everything is a function of the seed.

#ifndef DLCS_TESTS_PLAIN_PLAIN_SYSTEM_H_
#define DLCS_TESTS_PLAIN_PLAIN_SYSTEM_H_

#include <cstdint>

#include "tests/plain/plain_parts.h"

namespace dlcs::plain {

// Of the family seed % kFamilies; three in ten in other units, 2^-26 to 2^26, and three in ten in another order.
PlainSystem MakePlainSystem(uint64_t seed);
int NumFamilies();

}  // namespace dlcs::plain

#endif  // DLCS_TESTS_PLAIN_PLAIN_SYSTEM_H_
