// SPDX-License-Identifier: Apache-2.0
#include "client/local/option_range.h"

#include <stdexcept>
#include <string>

#include "core/problem/options.h"
#include "server/wire/convert.h"

namespace dlcs::client {

SolveOptionRange RangeOf(std::string_view field) {
  for (const OptionRange& range : kOptionRanges) {
    if (WireOptionName(range.field) == field) return {range.words, range.least, range.most};
  }
  throw std::logic_error("no range of " + std::string(field));
}

}  // namespace dlcs::client
