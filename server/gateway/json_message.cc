// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/json_message.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string_view>

#include "absl/status/status.h"
#include "fmt/format.h"
#include "google/protobuf/io/zero_copy_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "google/protobuf/util/json_util.h"
#include "google/protobuf/util/type_resolver.h"
#include "google/protobuf/util/type_resolver_util.h"
#include "nlohmann/json.hpp"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

using Json = nlohmann::json;

// As deep as protobuf's binary messages. Its JSON parser uses 300 bytes for each '[' of a body.
constexpr int kDeepest = 100;

google::protobuf::util::TypeResolver& Resolver() {
  static const std::unique_ptr<google::protobuf::util::TypeResolver> resolver(
      google::protobuf::util::NewTypeResolverForDescriptorPool("type.googleapis.com",
                                                               google::protobuf::DescriptorPool::generated_pool()));
  return *resolver;
}

std::string UrlOf(const google::protobuf::Descriptor& type) { return "type.googleapis.com/" + type.full_name(); }

// The pieces of a JSON text. Each ends outside of strings and after a separator, so that the parser keeps no part of it
// for the next one.
class JsonPieces final : public google::protobuf::io::ZeroCopyInputStream {
 public:
  JsonPieces(std::string_view json, const JsonBounds& bounds) : json_(json), bounds_(bounds) {}

  bool Next(const void** data, int* size) override {
    if (end_ == json_.size() || too_deep_) return false;
    stopped_ = stopped_ || !bounds_.is_wanted();
    if (stopped_) return false;
    const std::size_t begin = end_;
    const bool is_sound = FindEnd();
    too_deep_ = !is_sound;
    *data = json_.data() + begin;
    *size = static_cast<int>(end_ - begin);
    return is_sound;
  }

  // The parser uses Next() alone.
  void BackUp(int count) override { end_ -= static_cast<std::size_t>(count); }
  bool Skip(int /*count*/) override { return false; }
  std::int64_t ByteCount() const override { return static_cast<std::int64_t>(end_); }

  bool stopped() const { return stopped_; }
  bool too_deep() const { return too_deep_; }

 private:
  // Moves `end_` to the end of the next piece; false if the text is too deep.
  bool FindEnd() {
    const std::size_t enough = std::min(end_ + bounds_.piece_bytes, json_.size());
    while (end_ < json_.size()) {
      const char c = json_[end_++];
      if (quote_ != 0) {
        if (c == '\\' && end_ < json_.size()) ++end_;
        if (c == quote_) quote_ = 0;
        continue;
      }
      if (c == '"' || c == '\'') quote_ = c;  // the parser takes 'text' too
      if (c == '{' || c == '[') ++depth_;
      if (c == '}' || c == ']') --depth_;
      if (depth_ > kDeepest) return false;
      if (end_ >= enough && (c == ',' || c == '[' || c == '{')) return true;
    }
    return true;
  }

  const std::string_view json_;
  const JsonBounds& bounds_;
  std::size_t end_ = 0;
  int depth_ = 0;
  char quote_ = 0;  // inside of a string: how it began
  bool stopped_ = false;
  bool too_deep_ = false;
};

// Appends to a string of at most `max_bytes`.
class BoundedOutput final : public google::protobuf::io::ZeroCopyOutputStream {
 public:
  BoundedOutput(std::string& out, std::size_t max_bytes) : stream_(&out), max_bytes_(max_bytes) {}

  bool Next(void** data, int* size) override { return !is_full() && stream_.Next(data, size); }
  void BackUp(int count) override { stream_.BackUp(count); }
  std::int64_t ByteCount() const override { return stream_.ByteCount(); }
  bool is_full() const { return static_cast<std::size_t>(stream_.ByteCount()) > max_bytes_; }

 private:
  google::protobuf::io::StringOutputStream stream_;
  const std::size_t max_bytes_;
};

absl::Status NotInJson(const google::protobuf::Descriptor& type, const std::string& why) {
  return absl::InvalidArgumentError(fmt::format("the body is not a {} in JSON: {}", type.full_name(), why));
}

// `why` is the parser's: "(problem.a) dens: Cannot find field.", "(problem.x0[2]): invalid value ...", or a syntax
// error of several lines.
absl::Status Refused(const google::protobuf::Descriptor& type, const std::string& why) {
  static constexpr std::string_view kUnknown = ": Cannot find field.";
  std::string_view rule = why;
  std::string field;
  if (const std::size_t end = why.find(')'); why.starts_with('(') && end != std::string::npos) {
    field = why.substr(1, end - 1);
    rule.remove_prefix(std::min(why.find_first_not_of(": ", end + 1), why.size()));
  }
  if (rule.ends_with(kUnknown)) {
    field += (field.empty() ? "" : ".") + std::string(rule.substr(0, rule.size() - kUnknown.size()));
    return InvalidRequest({{.field = field, .description = "there is no such field"}});
  }
  if (field.empty()) return NotInJson(type, why);
  return InvalidRequest({{.field = field, .description = std::string(rule)}});
}

}  // namespace

std::string ValidUtf8(std::string_view text) {
  const std::string dumped = Json(std::string(text)).dump(-1, ' ', false, Json::error_handler_t::replace);
  return Json::parse(dumped).get<std::string>();
}

absl::StatusOr<std::string> JsonToMessage(const google::protobuf::Descriptor& type, const std::string& json,
                                          const JsonBounds& bounds) {
  // The parser would read all of any other value before it refuses it.
  const std::size_t first = json.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && json[first] != '{') return NotInJson(type, "it must begin with '{'");
  JsonPieces pieces(first == std::string::npos ? "{}" : std::string_view(json), bounds);
  std::string message;
  BoundedOutput output(message, bounds.max_bytes);
  const auto status = google::protobuf::util::JsonToBinaryStream(&Resolver(), UrlOf(type), &pieces, &output);
  if (pieces.stopped()) return absl::CancelledError("the translation was stopped");
  if (pieces.too_deep()) return NotInJson(type, fmt::format("more than {} levels", kDeepest));
  if (output.is_full()) {
    return absl::ResourceExhaustedError(
        fmt::format("the body is a {} of more than {} bytes, the limit", type.full_name(), bounds.max_bytes));
  }
  if (!status.ok()) return Refused(type, ValidUtf8({status.message().data(), status.message().size()}));
  return message;
}

absl::StatusOr<std::string> MessageToJson(const google::protobuf::Descriptor& type, const std::string& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string json;
  const auto status = google::protobuf::util::BinaryToJsonString(&Resolver(), UrlOf(type), message, &json, options);
  if (status.ok()) return json;
  return absl::InternalError(fmt::format("a {} that cannot be converted to JSON: {}", type.full_name(),
                                         std::string(status.message().data(), status.message().size())));
}

}  // namespace dlcs
