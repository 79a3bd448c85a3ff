// SPDX-License-Identifier: Apache-2.0
// "Did you mean": the name closest to a mistyped one.

#ifndef DLCS_PROTO_SHARED_NEAREST_NAME_H_
#define DLCS_PROTO_SHARED_NEAREST_NAME_H_

#include <optional>
#include <string>
#include <vector>

namespace dlcs {

// The entry of `known` with the fewest edits from `name` (insert, delete, replace; half an edit each: a change
// of case or of a separator, two neighbors exchanged, and an abbreviation of the whole or of one
// of its words to three letters or more), or nothing
// when even that one differs in more than half of its letters. Of equals the first wins. Cost: the lengths'
// product per entry.
std::optional<std::string> NearestName(const std::string& name, const std::vector<std::string>& known);

// "; did you mean MEANT?", for the end of a refusal; empty where there is no such name.
std::string DidYouMean(const std::optional<std::string>& meant);

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_NEAREST_NAME_H_
