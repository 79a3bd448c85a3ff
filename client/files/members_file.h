// SPDX-License-Identifier: Apache-2.0
// Files with the members of an ensemble: JSON as members.schema.json describes, or a table of initial states.

#ifndef DLCS_CLIENT_FILES_MEMBERS_FILE_H_
#define DLCS_CLIENT_FILES_MEMBERS_FILE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Reads a list of objects, or an object with that list under "members". Each object holds the keys that replace those
// of the problem, in the forms of problem files: x0, f, g, pieces (instead of f and g), T, break_points, parameters;
// and "label", a name for the output. A text that is not JSON is a table with one initial state per line, numbers
// separated by commas; a first line may name the states, in their order.
//
// The problem has m = `states` states, with the names `state_names` if there are any, and n = `constraints` pairs.
// `source` is the file's name for messages. Errors:
// InvalidArgument with one "source: members[3]: place rule" per line.
absl::StatusOr<std::vector<v1::EnsembleMember>> ParseMembers(const std::string& text, const std::string& source,
                                                             int states, int constraints,
                                                             const std::vector<std::string>& state_names = {});

// The same for the file at `path`, `-` for standard input. Errors: as above and as ReadTextFile().
absl::StatusOr<std::vector<v1::EnsembleMember>> ReadMembersFile(const std::string& path, int states, int constraints,
                                                                const std::vector<std::string>& state_names = {});

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_FILES_MEMBERS_FILE_H_
