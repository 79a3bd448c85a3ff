// SPDX-License-Identifier: Apache-2.0
// The fuzz targets. Where DLCS_BUILD_FUZZERS is on, each is a program of libFuzzer's; otherwise one program replays
// files for all of them.

#ifndef DLCS_TESTS_FUZZ_FUZZ_TARGET_H_
#define DLCS_TESTS_FUZZ_FUZZ_TARGET_H_

#include <string>

namespace dlcs::fuzz {

// Each processes `input` as a program processes text from outside. For any text it must not crash, hang, or break a
// promise that the target checks.
void TryDeck(const std::string& input);
void TryFormula(const std::string& input);
void TryGateway(const std::string& input);
void TryJobRequest(const std::string& input);
void TryLcpFile(const std::string& input);
void TryMatrixMarket(const std::string& input);
void TryMembersFile(const std::string& input);
void TryProblemFile(const std::string& input);
void TryRequest(const std::string& input);
void TrySolve(const std::string& input);
void TryStateArchive(const std::string& input);

// Ends the program with `promise` where it does not hold.
void Require(bool holds, const char* promise);

}  // namespace dlcs::fuzz

#endif  // DLCS_TESTS_FUZZ_FUZZ_TARGET_H_
