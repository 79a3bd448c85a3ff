// SPDX-License-Identifier: Apache-2.0
// Numbers in messages.

#ifndef DLCS_CORE_NUMBER_TEXT_H_
#define DLCS_CORE_NUMBER_TEXT_H_

#include <string>

namespace dlcs {

// The shortest decimal text that reads back as exactly `value`: "0.1", "1e-06", "nan", "-inf". No locale
// matters.
std::string NumberText(double value);

// Six significant digits, for sentences about results: "0.333333", "1e-06", "nan".
std::string FormatNumber(double value);

}  // namespace dlcs

#endif  // DLCS_CORE_NUMBER_TEXT_H_
