// SPDX-License-Identifier: Apache-2.0
// Implications between matrix classes, used to shorten tables.

#ifndef DLCS_CLIENT_CLI_OUTPUT_CLASS_IMPLICATIONS_H_
#define DLCS_CLIENT_CLI_OUTPUT_CLASS_IMPLICATIONS_H_

#include <span>
#include <string_view>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Every matrix of the class with id `narrow` is of the class with id `wide`.
struct ClassImplication {
  std::string_view narrow;
  std::string_view wide;
};
std::span<const ClassImplication> ClassImplications();

// Whether the answer of `finding`, one of `section`, follows from another answer of the section: a class that contains
// a class of the matrix, or one contained in a class that it is not of. False for findings that are not about classes.
bool Follows(const v1::Finding& finding, const v1::AnalysisSection& section);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_CLASS_IMPLICATIONS_H_
