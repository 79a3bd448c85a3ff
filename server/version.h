// SPDX-License-Identifier: Apache-2.0
#ifndef DLCS_SERVER_VERSION_H_
#define DLCS_SERVER_VERSION_H_

namespace dlcs {

// Of the project, as CMake knows it.
inline constexpr char kVersion[] = DLCS_VERSION;

}  // namespace dlcs

#endif  // DLCS_SERVER_VERSION_H_
