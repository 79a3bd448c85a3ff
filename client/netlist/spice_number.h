// SPDX-License-Identifier: Apache-2.0
// Numbers of SPICE decks.

#ifndef DLCS_CLIENT_NETLIST_SPICE_NUMBER_H_
#define DLCS_CLIENT_NETLIST_SPICE_NUMBER_H_

#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

namespace dlcs::client {

// A number with an optional suffix (t g meg k mil m u n p f, in either case; µ is u) and then letters of a unit (of
// ASCII, or Ω), which have no meaning: "10kOhm" is 10,000, "1F" is 1e-15. Empty if `text` is not a number. "4k7" is
// none, because dialects read it differently. The result is the double that is nearest.
std::optional<double> ReadSpiceNumber(std::string_view text);

// For numbers outside of decks, such as options: a number with one of these suffixes or none, but no unit, no mil, and
// no M, which others take for mega. What it reads, it reads as ReadSpiceNumber() does.
std::optional<double> ReadNumberWithSuffix(std::string_view text);

// The number without a sign at the beginning of `text`, and its length with suffix and unit; length 0 if there is none.
std::pair<double, std::size_t> LeadingSpiceNumber(std::string_view text);

inline bool IsSpiceDigit(char letter) { return letter >= '0' && letter <= '9'; }
// A letter of a name.
bool IsSpiceLetter(char letter);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_SPICE_NUMBER_H_
