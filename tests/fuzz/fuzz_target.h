// SPDX-License-Identifier: Apache-2.0
// What every fuzz target is made of. Each is a program: libFuzzer's where DLCS_BUILD_FUZZERS is on, otherwise one that
// replays files.

#ifndef DLCS_TESTS_FUZZ_FUZZ_TARGET_H_
#define DLCS_TESTS_FUZZ_FUZZ_TARGET_H_

#include <string>

namespace dlcs::fuzz {

// Defined by each target, once: does with `input` what a program does with text from outside. Whatever the text is, it
// may neither crash nor hang nor break a promise that the target checks.
void Try(const std::string& input);

// Ends the program with `promise` where it does not hold.
void Require(bool holds, const char* promise);

}  // namespace dlcs::fuzz

#endif  // DLCS_TESTS_FUZZ_FUZZ_TARGET_H_
