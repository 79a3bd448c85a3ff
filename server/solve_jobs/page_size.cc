// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/page_size.h"

#include <algorithm>

#include "fmt/format.h"
#include "server/wire/errors.h"

namespace dlcs {

absl::StatusOr<int> PageSize(int page_size) {
  constexpr int kDefault = 100;
  constexpr int kMax = 1000;
  if (page_size < 0) return InvalidRequest({{"page_size", fmt::format("{}; must not be negative", page_size)}});
  return page_size == 0 ? kDefault : std::min(page_size, kMax);
}

}  // namespace dlcs
