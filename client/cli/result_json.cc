// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "client/cli/ensemble_output.h"
#include "client/cli/result_output.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

using nlohmann::ordered_json;

// nlohmann prints the shortest digits that read back as the same double, and null for NaN and infinity.
std::string Dump(const ordered_json& value, int indent = 2) {
  return value.dump(indent, ' ', /*ensure_ascii=*/false, ordered_json::error_handler_t::replace);
}

template <typename Values>
ordered_json List(const Values& values) {
  return ordered_json(std::vector<typename Values::value_type>(values.begin(), values.end()));
}

ordered_json OrNull(bool has, double value) { return has ? ordered_json(value) : ordered_json(nullptr); }

ordered_json CertificateJson(const v1::Certificate& c) {
  return {{"node_residual", c.node_residual()},
          {"midpoint_residual", c.midpoint_residual()},
          {"node_complementarity", c.node_complementarity()},
          {"midpoint_complementarity", c.midpoint_complementarity()},
          {"ode_defect", c.ode_defect()},
          {"lcp_scale", c.lcp_scale()},
          {"ode_scale", c.ode_scale()},
          {"x_scale", c.x_scale()}};
}

ordered_json AccuracyJson(const v1::Accuracy& accuracy) {
  return {{"source", AccuracySourceName(accuracy.source())},
          {"error", OrNull(accuracy.has_error(), accuracy.error())},
          {"asked", OrNull(accuracy.asked() > 0, accuracy.asked())},
          {"asked_by_default", accuracy.asked_by_default()},
          {"errors_x", List(accuracy.errors_x())},
          {"errors_by", List(accuracy.errors_by())},
          {"errors_w", List(accuracy.errors_w())},
          {"note", accuracy.note()}};
}

ordered_json CostJson(const v1::Cost& c) {
  return {{"steps", c.steps()},
          {"windows", c.windows()},
          {"iterations", c.iterations()},
          {"lcps", c.lcps()},
          {"marched_steps", c.marched_steps()},
          {"newton_iterations", c.newton_iterations()},
          {"most_newton_iterations", c.most_newton_iterations()},
          {"substituted_steps", c.substituted_steps()},
          {"seconds_setup", c.seconds_setup()},
          {"seconds_lcp", c.seconds_lcp()},
          {"seconds_linear", c.seconds_linear()},
          {"seconds_total", c.seconds_total()},
          {"predicted_bytes", c.predicted_bytes()},
          {"process_peak_bytes", c.process_peak_bytes()}};
}

ordered_json NewtonJson(const v1::NewtonRecord& newton) {
  return {{"time", newton.time()},
          {"residuals", List(newton.residuals())},
          {"contraction", OrNull(newton.has_contraction(), newton.contraction())}};
}

ordered_json KernelJson(const v1::KernelRecord& kernel) {
  return {{"blocks_by_recursion", kernel.blocks_by_recursion()},
          {"blocks_by_contour", kernel.blocks_by_contour()},
          {"contours", kernel.contours()},
          {"factorizations", kernel.factorizations()},
          {"contour_error", kernel.contour_error()},
          {"fallback", kernel.fallback()}};
}

ordered_json RealisationJson(const v1::RealisationRecord& realisation) {
  return {{"used", Word(realisation.used())},
          {"reason", realisation.reason()},
          {"terms", realisation.terms()},
          {"factorizations", realisation.factorizations()},
          {"error", realisation.error()}};
}

ordered_json ContourJson(const v1::ContourRecord& contour) {
  return {{"nodes", contour.nodes()},
          {"gamma", contour.gamma()},
          {"mu", contour.mu()},
          {"step", contour.step()},
          {"choice", contour.choice()},
          {"sector_angle", contour.sector_angle()},
          {"log10_error", contour.log10_error()},
          {"separated", contour.separated()}};
}

ordered_json JumpsJson(const v1::Summary& summary) {
  ordered_json jumps = ordered_json::array();
  for (const v1::StateJump& jump : summary.jumps()) {
    jumps.push_back(
        {{"time", jump.time()}, {"dx", List(jump.dx())}, {"multiplier", List(jump.multiplier())}});
  }
  return jumps;
}

ordered_json SwitchingsJson(const v1::Summary& summary) {
  ordered_json switchings = ordered_json::array();
  for (const v1::SwitchingTime& switching : summary.switching_times()) {
    switchings.push_back({{"time", switching.time()},
                          {"kind", switching.kind()},
                          {"entering", List(switching.entering())},
                          {"leaving", List(switching.leaving())}});
  }
  return switchings;
}

ordered_json LeftLimitsJson(const SolveResult& result) {
  ordered_json limits = ordered_json::array();
  for (const v1::LeftLimit& limit : result.left_limits) {
    limits.push_back({{"time", result.times[static_cast<std::size_t>(limit.index())]},
                      {"y", List(limit.y())},
                      {"w", List(limit.w())}});
  }
  return limits;
}

ordered_json HeadJson(const std::string& name, const SolveResult& result) {
  const v1::Summary& s = result.summary;
  return {{"name", name},
          {"verdict", VerdictName(s)},
          {"success", Succeeded(s)},
          {"termination", TerminationName(s.termination())},
          {"message", s.message()},
          {"failure_time", OrNull(s.has_failure_time(), s.failure_time())},
          {"method", Word(s.method())},
          {"reason", s.reason()},
          {"states", result.names.states},
          {"pairs", result.names.pairs},
          {"matrix_class", result.analysis.matrix_class()},
          {"lipschitz", OrNull(result.analysis.has_lipschitz(), result.analysis.lipschitz())},
          {"warnings", List(s.warnings())},
          {"step", s.step()},
          {"iterations", s.cost().iterations()},
          {"seconds", s.cost().seconds_total()},
          {"concerns", List(s.verdict().concerns())},
          {"accuracy", AccuracyJson(s.accuracy())},
          {"certificate", CertificateJson(s.certificate())},
          {"cost", CostJson(s.cost())},
          {"kernel", s.has_kernel() ? KernelJson(s.kernel()) : ordered_json(nullptr)},
          {"realisation", s.has_realisation() ? RealisationJson(s.realisation()) : ordered_json(nullptr)},
          {"contour", s.has_contour() ? ContourJson(s.contour()) : ordered_json(nullptr)},
          {"newton", s.has_newton() ? NewtonJson(s.newton()) : ordered_json(nullptr)},
          {"jumps", JumpsJson(s)},
          {"switching_times", SwitchingsJson(s)},
          {"switchings", s.switchings()},
          {"left_limits", LeftLimitsJson(result)}};
}

// The shortest digits that read back as the same double. "-0" would be read as the integer 0.
std::string Digits(double number) {
  if (!std::isfinite(number)) return "null";
  return number == 0 && std::signbit(number) ? "-0.0" : fmt::format("{}", number);
}

void AppendNumbers(std::span<const double> numbers, fmt::memory_buffer& line) {
  const char* separator = "[";
  for (const double number : numbers) {
    fmt::format_to(std::back_inserter(line), "{}{}", separator, Digits(number));
    separator = ", ";
  }
  fmt::format_to(std::back_inserter(line), "{}", numbers.empty() ? "[]" : "]");
}

// "key": [[...], [...]] on the line that `line` is.
template <typename ValuesAt>
void AppendPerTime(const char* key, std::size_t times, const ValuesAt& values_at, fmt::memory_buffer& line) {
  fmt::format_to(std::back_inserter(line), ", \"{}\": [", key);
  for (std::size_t k = 0; k < times; ++k) {
    if (k > 0) fmt::format_to(std::back_inserter(line), ", ");
    AppendNumbers(values_at(k), line);
  }
  line.push_back(']');
}

void Write(const fmt::memory_buffer& line, std::FILE* out) { std::fwrite(line.data(), 1, line.size(), out); }

// "key": [[...], [...]] with one time on each line. Written as it goes: a trajectory may be large.
template <typename ValuesAt>
void PrintPerTime(const char* key, std::size_t times, const ValuesAt& values_at, std::FILE* out) {
  fmt::print(out, ",\n  \"{}\": [", key);
  for (std::size_t k = 0; k < times; ++k) {
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{}\n    ", k == 0 ? "" : ",");
    AppendNumbers(values_at(k), line);
    Write(line, out);
  }
  fmt::print(out, "{}]", times == 0 ? "" : "\n  ");
}

}  // namespace

void PrintJson(const std::string& name, const SolveResult& result, std::FILE* out) {
  std::string head = Dump(HeadJson(name, result));
  head.resize(head.size() - 2);  // "\n}" comes after the trajectory
  fmt::print(out, "{},\n  \"times\": ", head);
  fmt::memory_buffer times;
  AppendNumbers(result.times, times);
  Write(times, out);
  PrintPerTime(
      "x", result.times.size(), [&](std::size_t k) { return result.x_at(k); }, out);
  PrintPerTime(
      "y", result.times.size(), [&](std::size_t k) { return result.y_at(k); }, out);
  if (result.has_w() || result.times.empty())
    PrintPerTime(
        "w", result.times.size(), [&](std::size_t k) { return result.w_at(k); }, out);
  fmt::print(out, "\n}}\n");
}

void PrintJsonLine(const MemberResult& member, std::FILE* out) {
  const SolveResult& result = member.result;
  ordered_json head = {{"member", member.member}, {"label", member.label}};
  head.update(HeadJson("", result));
  for (const char* of_the_analysis : {"name", "matrix_class", "lipschitz"}) head.erase(of_the_analysis);
  fmt::memory_buffer line;
  const std::string text = Dump(head, -1);
  line.append(text.data(), text.data() + text.size() - 1);  // "}" comes after the trajectory
  fmt::format_to(std::back_inserter(line), ", \"times\": ");
  AppendNumbers(result.times, line);
  AppendPerTime(
      "x", result.times.size(), [&](std::size_t k) { return result.x_at(k); }, line);
  AppendPerTime(
      "y", result.times.size(), [&](std::size_t k) { return result.y_at(k); }, line);
  if (result.has_w() || result.times.empty())
    AppendPerTime(
        "w", result.times.size(), [&](std::size_t k) { return result.w_at(k); }, line);
  fmt::format_to(std::back_inserter(line), "}}\n");
  Write(line, out);
}

}  // namespace dlcs::client
