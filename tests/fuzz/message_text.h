// SPDX-License-Identifier: Apache-2.0
// Messages of the contract as inputs of fuzz targets: a first line "# proto-message: dlcs.v1.SolveRequest", then the
// text format. People can read them, and libFuzzer changes their fields instead of their bytes (message_mutator.cc).

#ifndef DLCS_TESTS_FUZZ_MESSAGE_TEXT_H_
#define DLCS_TESTS_FUZZ_MESSAGE_TEXT_H_

#include <google/protobuf/message.h>

#include <memory>
#include <string>

namespace dlcs::fuzz {

// Null if `input` is not such a text, or its type is in no .proto of this program.
std::unique_ptr<google::protobuf::Message> MessageOf(const std::string& input);
std::string TextOf(const google::protobuf::Message& message);

}  // namespace dlcs::fuzz

#endif  // DLCS_TESTS_FUZZ_MESSAGE_TEXT_H_
