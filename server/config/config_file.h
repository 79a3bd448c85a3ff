// SPDX-License-Identifier: Apache-2.0
// A file of settings: one `key = value` a line.

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
// Errors: InvalidArgument with `path`, the line, what it says and the rule; a key may be given once, and neither the
// file (1 MB) nor a line (4096 bytes) may be of any length. What keys there are is not known here.
absl::StatusOr<std::vector<Setting>> ReadSettings(std::istream& input, const std::string& path);

// `key = value` as ReadSettings() reads it.
std::string WriteSetting(const std::string& key, const std::string& value);

// `value` with *** in place of a password: that of a URL (scheme://user:password@host) or of a connection string
// (password=...). Of one of more than 8192 bytes only their number.
std::string WithoutPassword(const std::string& value);

}  // namespace dlcs

#endif  // DLCS_SERVER_CONFIG_CONFIG_FILE_H_
