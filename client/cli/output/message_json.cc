// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/message_json.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

namespace dlcs::client {
namespace {

// Collects text and writes it in large pieces.
class JsonWriter {
 public:
  explicit JsonWriter(std::FILE* out) : out_(out) {}
  ~JsonWriter() { Flush(); }

  void Text(std::string_view text) { buffer_.append(text); }

  void Numbers(std::span<const double> numbers) {
    const char* separator = "[";
    for (const double number : numbers) {
      Text(separator);
      Number(number);
      separator = ",";
    }
    Text(numbers.empty() ? "[]" : "]");
    if (buffer_.size() > kPiece) Flush();
  }

 private:
  static constexpr std::size_t kPiece = 1 << 16;

  void Number(double number) {
    if (!std::isfinite(number)) {
      Text(std::isnan(number) ? "\"NaN\"" : number > 0 ? "\"Infinity\"" : "\"-Infinity\"");
      return;
    }
    if (number == 0) return Text(std::signbit(number) ? "-0.0" : "0");
    const std::size_t begin = buffer_.size();
    fmt::format_to(std::back_inserter(buffer_), "{:.15g}", number);
    buffer_.push_back('\0');
    const bool same = std::strtod(buffer_.data() + begin, nullptr) == number;
    buffer_.resize(same ? buffer_.size() - 1 : begin);
    if (!same) fmt::format_to(std::back_inserter(buffer_), "{:.17g}", number);
  }

  void Flush() {
    std::fwrite(buffer_.data(), 1, buffer_.size(), out_);
    buffer_.clear();
  }

  std::FILE* out_;
  fmt::memory_buffer buffer_;
};

// The beginning of `text`, an object whose last key is that of empty outputs, up to that key.
std::string WithoutOutputs(std::string text) {
  text.resize(text.rfind(R"(,"outputs":)"));
  return text;
}

// v1::TrajectoryChunk of the whole trajectory.
void WriteTrajectory(const SolveResult& result, JsonWriter& writer) {
  writer.Text(R"({"first":0,"times":)");
  writer.Numbers(result.times);
  writer.Text(R"(,"x":)");
  writer.Numbers(result.x);
  writer.Text(R"(,"y":)");
  writer.Numbers(result.y);
  writer.Text(R"(,"left_limits":[)");
  for (std::size_t k = 0; k < result.left_limits.size(); ++k) {
    if (k > 0) writer.Text(",");
    writer.Text(JsonLine(result.left_limits[k]));
  }
  writer.Text(R"(],"w":)");
  writer.Numbers(result.w);
  writer.Text(R"(,"outputs":[]})");  // by name in the document
}

// {"v(out)": [...], ...}
void WriteOutputs(const SolveResult& result, JsonWriter& writer) {
  std::vector<double> values(result.times.size());
  writer.Text("{");
  for (std::size_t i = 0; i < result.names.outputs.size(); ++i) {
    if (i > 0) writer.Text(",");
    writer.Text(nlohmann::json(result.names.outputs[i]).dump());
    writer.Text(":");
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = result.outputs_at(k)[i];
    writer.Numbers(values);
  }
  writer.Text("}");
}

// `document`, whose last fields are a trajectory that is not set and empty outputs, with those of `result`.
void WriteDocument(const google::protobuf::Message& document, const SolveResult& result, std::FILE* out) {
  JsonWriter writer(out);
  writer.Text(WithoutOutputs(JsonLine(document)));
  writer.Text(R"(,"trajectory":)");
  WriteTrajectory(result, writer);
  writer.Text(R"(,"outputs":)");
  WriteOutputs(result, writer);
  writer.Text("}\n");
}

}  // namespace

std::string JsonLine(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  return status.ok() ? text : "{}";  // a time beyond the year 9999 has no text
}

void PrintJson(const std::string& title, const SolveResult& result, std::FILE* out) {
  v1::SolveResult document;
  document.set_title(title);
  document.set_job(result.job);
  *document.mutable_analysis() = result.analysis;
  *document.mutable_summary() = result.summary;
  WriteDocument(document, result, out);
}

void PrintJson(const MemberResult& member, std::FILE* out) {
  v1::MemberResult document;
  document.set_member(static_cast<std::int32_t>(member.member));
  document.set_label(member.label);
  *document.mutable_summary() = member.result.summary;
  WriteDocument(document, member.result, out);
}

}  // namespace dlcs::client
