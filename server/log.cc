// SPDX-License-Identifier: Apache-2.0
#include "server/log.h"

#include <chrono>
#include <ctime>
#include <memory>
#include <string_view>
#include <utility>

#include "fmt/chrono.h"
#include "fmt/format.h"
#include "google/protobuf/stubs/logging.h"
#include "grpc/support/log.h"
#include "nlohmann/json.hpp"
#include "spdlog/formatter.h"
#include "spdlog/pattern_formatter.h"
#include "spdlog/sinks/stdout_color_sinks.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

// The fields of the line that this thread is writing, since spdlog passes only text to a formatter.
thread_local const LogFields* fields_of_line = nullptr;

bool IsLeftOut(const LogField& field) {
  const auto* const text = std::get_if<std::string>(&field.value);
  return text != nullptr && text->empty();
}

std::string Rfc3339(spdlog::log_clock::time_point time) {
  const auto since_epoch = time.time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(since_epoch);
  const auto micros = std::chrono::duration_cast<std::chrono::microseconds>(since_epoch - seconds);
  return fmt::format("{:%FT%T}.{:06}Z", fmt::gmtime(static_cast<std::time_t>(seconds.count())), micros.count());
}

class JsonLines final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& line, spdlog::memory_buf_t& output) override {
    nlohmann::ordered_json json;
    json["time"] = Rfc3339(line.time);
    const auto level = spdlog::level::to_string_view(line.level);
    json["level"] = std::string(level.data(), level.size());
    json["message"] = std::string(line.payload.data(), line.payload.size());
    if (fields_of_line != nullptr) {
      for (const LogField& field : *fields_of_line) {
        if (IsLeftOut(field)) continue;
        std::visit([&](const auto& value) { json[field.name] = value; }, field.value);
      }
    }
    // Callers and libraries may send bytes that are not UTF-8.
    const std::string text = json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    output.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<JsonLines>(); }
};

// One word, or quoted text; always on one line.
std::string Word(const std::string& text) {
  const bool is_word = text.find_first_of(" \"\\=") == std::string::npos;
  bool is_printable = true;
  for (const unsigned char c : text) is_printable = is_printable && c >= ' ' && c != 0x7f;
  if (is_word && is_printable) return text;
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

class TextLines final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& line, spdlog::memory_buf_t& output) override {
    std::string text;
    for (const char c : line.payload) text += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    if (fields_of_line != nullptr) {
      for (const LogField& field : *fields_of_line) {
        if (IsLeftOut(field)) continue;
        text += fmt::format(" {}=", field.name);
        if (const auto* word = std::get_if<std::string>(&field.value)) text += Word(*word);
        if (const auto* count = std::get_if<std::int64_t>(&field.value)) text += fmt::format("{}", *count);
        if (const auto* number = std::get_if<double>(&field.value)) text += fmt::format("{:.4g}", *number);
      }
    }
    spdlog::details::log_msg whole = line;
    whole.payload = text;
    pattern_.format(whole, output);
    line.color_range_start = whole.color_range_start;
    line.color_range_end = whole.color_range_end;
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<TextLines>(); }

 private:
  spdlog::pattern_formatter pattern_{"%Y-%m-%d %H:%M:%S.%e %^%l%$ %v"};
};

// Messages about callers without TLS or with an unknown certificate: not a fault of this server, and callers could
// cause any number of them.
bool IsOfHandshake(const gpr_log_func_args& line) {
  return std::string_view(line.file).find("ssl_transport_security") != std::string_view::npos;
}

void LogFromGrpc(gpr_log_func_args* args) {
  switch (args->severity) {
    case GPR_LOG_SEVERITY_ERROR:
      return spdlog::log(IsOfHandshake(*args) ? spdlog::level::info : spdlog::level::err, "gRPC: {}", args->message);
    case GPR_LOG_SEVERITY_INFO:
      return spdlog::info("gRPC: {}", args->message);
    case GPR_LOG_SEVERITY_DEBUG:
      return spdlog::debug("gRPC: {}", args->message);
  }
}

void LogFromProtobuf(google::protobuf::LogLevel level, const char*, int, const std::string& message) {
  spdlog::log(level >= google::protobuf::LOGLEVEL_ERROR ? spdlog::level::err : spdlog::level::info, "protobuf: {}",
              message);
}

}  // namespace

void Log(spdlog::level::level_enum level, const std::string& message, const LogFields& fields) {
  if (!spdlog::should_log(level)) return;
  fields_of_line = &fields;
  spdlog::log(level, spdlog::string_view_t(message));
  fields_of_line = nullptr;
}

void SetUpLog(const std::string& level, LogFormat format) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("dlcsd"));
  spdlog::set_level(spdlog::level::from_str(level));
  if (format == LogFormat::kJson) {
    spdlog::set_formatter(std::make_unique<JsonLines>());
  } else {
    spdlog::set_formatter(std::make_unique<TextLines>());
  }
  gpr_set_log_function(LogFromGrpc);
  google::protobuf::SetLogHandler(LogFromProtobuf);
}

}  // namespace dlcs
