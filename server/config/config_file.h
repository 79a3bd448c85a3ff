// SPDX-License-Identifier: Apache-2.0
// A configuration file: one `key = value` per line.

#ifndef DLCS_SERVER_CONFIG_CONFIG_FILE_H_
#define DLCS_SERVER_CONFIG_CONFIG_FILE_H_

#include <istream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace dlcs {

struct Setting {
  std::string key;
  std::string value;
  int line = 0;  // from 1
};

// Reads lines as
//
//     # whole lines, and ends of lines behind a blank, are comments
//     max-steps = 1000000
//     store = "/var/lib/dlcs/the # of jobs.db"   # quotes, double or single, keep everything between them
//
// Errors: InvalidArgument with `path`, the line, its text and the rule. A key may be given only once; the file is
// limited to 1 MB and a line to 4096 bytes. Keys are not checked here.
absl::StatusOr<std::vector<Setting>> ReadSettings(std::istream& input, const std::string& path);

// `key = value` as ReadSettings() reads it.
std::string WriteSetting(const std::string& key, const std::string& value);

// `value` with *** in place of the password in a URL (scheme://user:password@host) or a connection string
// (password=...). If it is longer than 8192 bytes, only its length.
std::string WithoutPassword(const std::string& value);

}  // namespace dlcs

#endif  // DLCS_SERVER_CONFIG_CONFIG_FILE_H_
