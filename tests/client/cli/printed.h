// SPDX-License-Identifier: Apache-2.0
// What a function prints on a stream, as text.

#ifndef DLCS_TESTS_CLIENT_CLI_PRINTED_H_
#define DLCS_TESTS_CLIENT_CLI_PRINTED_H_

#include <cstdio>
#include <cstdlib>
#include <string>

namespace dlcs::client {

template <typename Print>
std::string Printed(const Print& print) {
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* stream = open_memstream(&text, &size);
  print(stream);
  std::fclose(stream);
  const std::string result(text, size);
  std::free(text);
  return result;
}

}  // namespace dlcs::client

#endif  // DLCS_TESTS_CLIENT_CLI_PRINTED_H_
