// SPDX-License-Identifier: Apache-2.0
// "Did you mean": the name closest to a mistyped one.

#ifndef DLCS_PROTO_SHARED_NEAREST_NAME_H_
#define DLCS_PROTO_SHARED_NEAREST_NAME_H_

#include <optional>
#include <string>
#include <vector>

namespace dlcs {

// The entry of `known` with the fewest edits from `name` (insert, delete, replace; half an edit each: a change of case
// or of a separator, two neighbors exchanged, and an abbreviation of the whole or of one of its words to three letters
// or more). Absent if even that one differs in more than half of its letters. The first of equal ones wins. Cost: the
// product of the lengths per entry.
std::optional<std::string> NearestName(const std::string& name, const std::vector<std::string>& known);

// "; did you mean MEANT?", to be appended to an error; empty if there is no such name.
std::string DidYouMean(const std::optional<std::string>& meant);

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_NEAREST_NAME_H_
