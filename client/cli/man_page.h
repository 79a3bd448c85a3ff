// SPDX-License-Identifier: Apache-2.0
// The manual page, dlcs(1), made from the commands and their options.

#ifndef DLCS_CLIENT_CLI_MAN_PAGE_H_
#define DLCS_CLIENT_CLI_MAN_PAGE_H_

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace dlcs::client {

// The page in roff, with the macros of man(7). Options have the groups of the help, in the order of `groups`.
std::string ManPage(const CLI::App& app, const std::vector<std::string>& groups);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_MAN_PAGE_H_
