// SPDX-License-Identifier: Apache-2.0
// The version of the program.

#ifndef DLCS_SERVER_SESSION_VERSION_H_
#define DLCS_SERVER_SESSION_VERSION_H_

#include <string>

namespace dlcs {

// The version of the project, set by CMake.
inline constexpr char kVersion[] = DLCS_VERSION;

// How the program was built, as of the last run of CMake.
struct BuildInfo {
  const char* revision;  // "v0.1.0-12-g00e0c43"; "unknown" outside a git repository
  const char* compiler;  // "GNU 12.2.0"
  const char* type;      // "Release"
};
extern const BuildInfo kBuild;

// "v0.1.0-12-g00e0c43, GNU 12.2.0, Release"
std::string BuildText();

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_VERSION_H_
