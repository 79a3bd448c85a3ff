// SPDX-License-Identifier: Apache-2.0
// Numbers and lists in messages.

#ifndef DLCS_CORE_FORMAT_NUMBER_H_
#define DLCS_CORE_FORMAT_NUMBER_H_

#include <string>
#include <vector>

#include "core/types.h"

namespace dlcs {

// The shortest decimal text that reads back as exactly `value`: "0.1", "1e-06", "nan", "-inf". Does not depend on the
// locale.
std::string NumberText(double value);

// Six significant digits, for sentences about results: "0.333333", "1e-06", "nan".
std::string FormatNumber(double value);

// "2x3"
std::string ShapeText(Index rows, Index columns);

// "a, b and c"
std::string ListText(const std::vector<std::string>& words);

}  // namespace dlcs

#endif  // DLCS_CORE_FORMAT_NUMBER_H_
