// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/message_text.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <string_view>

namespace dlcs::fuzz {
namespace {

using google::protobuf::Message;

constexpr std::string_view kHead = "# proto-message: ";

class Silent final : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int, google::protobuf::io::ColumnNumber, const std::string&) override {}
};

}  // namespace

std::unique_ptr<Message> MessageOf(const std::string& input) {
  const std::size_t end = input.find('\n');
  if (!input.starts_with(kHead) || end == std::string::npos) return nullptr;
  const auto* type = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(
      input.substr(kHead.size(), end - kHead.size()));
  if (type == nullptr) return nullptr;
  std::unique_ptr<Message> message(google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
  Silent silent;
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&silent);
  return parser.ParseFromString(input.substr(end + 1), message.get()) ? std::move(message) : nullptr;
}

std::string TextOf(const Message& message) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(message, &text);
  return std::string(kHead) + message.GetDescriptor()->full_name() + "\n" + text;
}

}  // namespace dlcs::fuzz
