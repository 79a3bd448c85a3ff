// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/output/result_output.h"
#include "client/cli/terminal/columns.h"
#include "client/cli/terminal/words.h"
#include "client/cli/terminal/wrapped_text.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

using Doubles = google::protobuf::RepeatedField<double>;

std::vector<Column> MakeColumns(const SolveResult& result) {
  const std::size_t rows = result.times.size();
  std::vector<Column> columns;
  columns.push_back(MakeColumn("t", rows, [&](std::size_t k) { return result.times[k]; }));
  for (std::size_t i = 0; i < result.names.outputs.size(); ++i) {
    columns.push_back(MakeColumn(ColumnName("output", result.names.outputs[i]), rows,
                                 [&](std::size_t k) { return result.outputs_at(k)[i]; }));
  }
  if (result.has_outputs()) return columns;
  for (std::size_t i = 0; i < result.states; ++i) {
    columns.push_back(MakeColumn(result.names.OfX(i), rows, [&](std::size_t k) { return result.x_at(k)[i]; }));
  }
  for (std::size_t i = 0; i < result.constraints; ++i) {
    columns.push_back(MakeColumn(result.names.OfY(i), rows, [&](std::size_t k) { return result.y_at(k)[i]; }));
    if (!result.has_w()) continue;
    columns.push_back(MakeColumn(result.names.OfW(i), rows, [&](std::size_t k) { return result.w_at(k)[i]; }));
  }
  return columns;
}

void PrintMeasurements(const v1::Summary& summary, int width, std::FILE* out) {
  if (summary.measurements().empty()) return;
  fmt::print(out, "\nMeasurements\n");
  std::size_t longest = 0;
  for (const v1::MeasurementResult& one : summary.measurements()) longest = std::max(longest, one.name().size());
  Paragraphs paper(width, out);
  for (const v1::MeasurementResult& one : summary.measurements()) {
    const std::string name = fmt::format("  {:<{}}  ", one.name(), longest);
    const bool says_when = one.has_time() && one.time() != one.value();
    const std::string note = one.note().empty() ? "" : fmt::format(" ({})", one.note());
    paper.Print(name, !one.has_value() ? fmt::format("none: {}", one.reason())
                      : says_when      ? fmt::format("{} at t = {}{}", Cell(one.value()), Cell(one.time()), note)
                                       : Cell(one.value()) + note);
  }
}

void PrintJumps(const v1::Summary& summary, std::FILE* out) {
  if (summary.jumps().empty()) return;
  fmt::print(out, "\nState jumps\n");
  for (const v1::StateJump& jump : summary.jumps()) {
    fmt::print(out, "  at t = {}: dx = {}, multiplier {}\n", Cell(jump.time()), Listed(jump.dx()),
               Listed(jump.multiplier()));
  }
}

// "y2, y4", the names of the columns of the table.
std::string NamesOf(const google::protobuf::RepeatedField<std::int32_t>& indices, const DisplayNames& names) {
  if (indices.empty()) return "-";
  std::vector<std::string> listed;
  for (const std::int32_t i : indices) listed.push_back(names.OfY(static_cast<std::size_t>(i)));
  return fmt::format("{}", fmt::join(listed, ", "));
}

// The switching times: which y may be positive from a time on (active), and which are 0 (inactive).
void PrintSwitchings(const v1::Summary& summary, const DisplayNames& names, std::FILE* out) {
  constexpr int kMaxRows = 30;
  if (summary.switching_times().empty()) return;
  fmt::print(out, "\nSwitching times\n");
  const int rows = std::min(summary.switching_times_size(), kMaxRows);
  std::size_t width = 12;  // of the column of active pairs, whose names may be long
  for (int k = 0; k < rows; ++k) {
    width = std::max(width, LetterCount(NamesOf(summary.switching_times(k).entering(), names)));
  }
  const auto print_row = [&](const std::string& time, const std::string& kind, const std::string& active,
                             const std::string& inactive) {
    fmt::print(out, "  {:>14}  {:<20}  {}  {}\n", time, kind, Padded(active, width), inactive);
  };
  print_row("t", "", "active", "inactive");
  for (int k = 0; k < rows; ++k) {
    const v1::SwitchingTime& switching = summary.switching_times(k);
    std::string kind = Word(switching.kind());
    std::replace(kind.begin(), kind.end(), '-', ' ');
    print_row(fmt::format("{:.10g}", switching.time()), kind, NamesOf(switching.entering(), names),
              NamesOf(switching.leaving(), names));
  }
  if (summary.switchings() > rows) {
    fmt::print(out, "  and {} more; --format json has them\n", summary.switchings() - rows);
  }
}

// The estimated error, and how it was estimated.
void PrintAccuracy(const v1::Accuracy& accuracy, std::FILE* out) {
  if (accuracy.has_error()) {
    const auto largest = [](const Doubles& errors) { return *std::max_element(errors.begin(), errors.end()); };
    std::string parts;
    if (!accuracy.errors_x().empty()) parts += fmt::format(": {:.1e} of x", largest(accuracy.errors_x()));
    if (!accuracy.errors_y().empty()) parts += fmt::format(", {:.1e} of y", largest(accuracy.errors_y()));
    if (!accuracy.errors_w().empty()) parts += fmt::format(", {:.1e} of w", largest(accuracy.errors_w()));
    if (!accuracy.errors_outputs().empty()) {
      parts += fmt::format(", {:.1e} of outputs", largest(accuracy.errors_outputs()));
    }
    fmt::print(out, "  estimated error  {:.1e} of the size of each component{}\n", accuracy.error(), parts);
  } else {
    fmt::print(out, "  estimated error  none\n");
  }
  if (!accuracy.note().empty()) fmt::print(out, "                   {}\n", accuracy.note());
}

void PrintCertificate(const v1::Certificate& c, std::FILE* out) {
  if (std::isnan(c.node_residual())) return;  // nothing was measured
  fmt::print(out, "\nCertificate\n");
  fmt::print(out, "  LCP residual     {:.1e} at nodes, {:.1e} between them (size of y, w: {:.2g})\n", c.node_residual(),
             c.midpoint_residual(), c.lcp_scale());
  fmt::print(out, "  complementarity  {:.1e} at nodes, {:.1e} between them\n", c.node_complementarity(),
             c.midpoint_complementarity());
  // If x solves the differential equation exactly for the computed y, the defect does not show the error of y.
  const bool exact = c.ode_defect() <= 1e-14 * c.ode_scale();
  fmt::print(out, "  defect of x'     {:.1e} between nodes (size of x': {:.2g})\n", c.ode_defect(), c.ode_scale());
  if (exact) fmt::print(out, "                   for the computed y: it does not show the error of y\n");
}

// "0.98", "0.1 + 0.2i (size 0.22)", to six digits.
std::string MultiplierText(const v1::Multiplier& multiplier) {
  if (multiplier.imaginary() == 0) return fmt::format("{:.6g}", multiplier.real());
  return fmt::format("{:.6g} {} {:.6g}i (size {:.6g})", multiplier.real(), multiplier.imaginary() < 0 ? "-" : "+",
                     std::abs(multiplier.imaginary()), std::hypot(multiplier.real(), multiplier.imaginary()));
}

// "stable: disturbances shrink by 2.1 % a period".
std::string StabilityText(const v1::PeriodicSolution& periodic) {
  const double size = 1 + periodic.growth();
  switch (periodic.stability()) {
    case v1::STABILITY_STABLE:
      if (size == 0) return "stable: disturbances die out within a period";
      return size < 0.5 ? fmt::format("stable: disturbances shrink to {:.2g} of their size in a period", size)
                        : fmt::format("stable: disturbances shrink by {:.2g} % a period", -100 * periodic.growth());
    case v1::STABILITY_UNSTABLE:
      return size > 2 ? fmt::format("unstable: disturbances grow by a factor of {:.2g} a period", size)
                      : fmt::format("unstable: disturbances grow by {:.2g} % a period", 100 * periodic.growth());
    case v1::STABILITY_UNDETERMINED:
      return periodic.multipliers().empty() ? "not known, since the multipliers are not"
                                            : "not known: the multipliers, with their errors, do not tell";
    default:
      return "";
  }
}

// The period, what becomes of disturbances, and averages.
void PrintPeriodic(const SolveResult& result, int width, std::FILE* out) {
  constexpr int kMaxMultipliers = 10;
  const v1::Summary& summary = result.summary;
  const v1::PeriodicSolution& periodic = summary.periodic();
  if (!summary.has_periodic() || !(periodic.period() > 0)) return;
  fmt::print(out, "\nPeriodic solution\n");
  const std::string phase = periodic.phase() > 0 ? fmt::format(", from t = {} on", Cell(periodic.phase())) : "";
  fmt::print(out, "  period           {:.12g}{}\n", periodic.period(), phase);
  fmt::print(out, "  found in         {} integrated, {} of Newton's method\n", Count(periodic.periods(), "period"),
             Count(periodic.newton_iterations(), "step"));
  if (periodic.has_residual()) {
    const std::string error = periodic.has_error() ? fmt::format("; error of x(0) {:.1e}", periodic.error()) : "";
    fmt::print(out, "  x(period) - x(0) {:.1e} of the size of a state{}\n", periodic.residual(), error);
  }
  if (const std::string stability = StabilityText(periodic); !stability.empty()) {
    Paragraphs(width, out).Print("  stability        ", stability);
  }
  std::vector<std::string> multipliers;
  for (const v1::Multiplier& multiplier : periodic.multipliers()) {
    if (multipliers.size() == kMaxMultipliers) break;
    multipliers.push_back(MultiplierText(multiplier));
  }
  if (!multipliers.empty()) {
    const int more = periodic.multipliers_size() - kMaxMultipliers;
    Paragraphs(width, out)
        .Print("  multipliers      ", fmt::format("{}{}", fmt::join(multipliers, ", "),
                                                  more > 0 ? fmt::format(", and {} smaller ones", more) : ""));
  }
  std::vector<std::string> means;
  const auto add = [&](const auto& values, const auto& name) {
    for (int i = 0; i < values.size(); ++i) {
      means.push_back(fmt::format("{} {:.6g}", name(static_cast<std::size_t>(i)), values[i]));
    }
  };
  if (!periodic.mean_outputs().empty()) {
    add(periodic.mean_outputs(), [&](std::size_t i) { return ColumnName("output", result.names.outputs.at(i)); });
  } else {
    add(periodic.mean_x(), [&](std::size_t i) { return result.names.OfX(i); });
    add(periodic.mean_y(), [&](std::size_t i) { return result.names.OfY(i); });
    add(periodic.mean_w(), [&](std::size_t i) { return result.names.OfW(i); });
  }
  if (!means.empty()) Paragraphs(width, out).Print("  averages         ", fmt::format("{}", fmt::join(means, ", ")));
}

// The residuals of Newton's method in the step with the most iterations.
void PrintNewton(const v1::Summary& summary, std::FILE* out) {
  if (!summary.has_newton()) return;
  const v1::Cost& cost = summary.cost();
  const v1::NewtonRecord& newton = summary.newton();
  fmt::print(out, "\nNewton's method\n");
  fmt::print(out, "  {} in {}, at most {} in one\n", Count(cost.newton_iterations(), "iteration"),
             Count(cost.steps(), "step"), cost.most_newton_iterations());
  if (cost.substituted_steps() > 0) {
    fmt::print(out, "  {} not solved by it, but by substitution\n", Count(cost.substituted_steps(), "step"));
  }
  std::vector<std::string> residuals;
  for (const double residual : newton.residuals()) residuals.push_back(fmt::format("{:.1e}", residual));
  fmt::print(out, "  residuals of the step to t = {}: {}\n", Cell(newton.time()), fmt::join(residuals, ", "));
  if (newton.has_contraction()) {
    fmt::print(out, "  step times κ = {:.2g}; convergence is certain below 1/3\n", newton.contraction());
  }
}

// How the kernel of the Laplace iteration, or the integrals of the Wu-Chen iteration, were computed.
void PrintContours(const v1::Summary& summary, std::FILE* out) {
  const v1::KernelRecord& kernel = summary.kernel();
  if (kernel.blocks_by_contour() > 0 || !kernel.fallback().empty()) {
    fmt::print(out, "\nKernel\n  {} by contours, {} by recursion; {}, {}, error {:.1e}\n",
               Count(kernel.blocks_by_contour(), "block"), kernel.blocks_by_recursion(),
               Count(kernel.contours(), "contour"), Count(kernel.factorizations(), "factorization"),
               kernel.contour_error());
    if (!kernel.fallback().empty()) fmt::print(out, "  contours not used: {}\n", kernel.fallback());
  }
  if (!summary.has_contour()) return;
  const v1::ContourRecord& contour = summary.contour();
  fmt::print(out, "\nContour ({})\n", contour.choice());
  if (contour.nodes() > 0) {
    fmt::print(out, "  P = {}, gamma {:.4g}, mu {:.4g}, step {:.4g}; for the sector of {:.3g}, error near 10^{:.1f}\n",
               contour.nodes(), contour.gamma(), contour.mu(), contour.step(), contour.sector_angle(),
               contour.log10_error());
  }
  if (contour.separated() > 0) {
    fmt::print(out, "  {} outside the sector, by matrix functions instead\n", Count(contour.separated(), "eigenvalue"));
  }
}

// The propagator, unless it is that of dense matrices.
void PrintPropagator(const v1::Summary& summary, int width, std::FILE* out) {
  const v1::PropagatorRecord& propagator = summary.propagator();
  if (propagator.used() == v1::PROPAGATOR_KIND_UNSPECIFIED || propagator.used() == v1::PROPAGATOR_KIND_DENSE) return;
  fmt::print(out, "\nPropagator\n");
  std::string text = Word(propagator.used());
  if (propagator.terms() > 0) text += ", " + Count(propagator.terms(), "term");
  if (propagator.factorizations() > 0) text += ", " + Count(propagator.factorizations(), "sparse factorization");
  if (propagator.linear_iterations() > 0) {
    text += ", " + Count(propagator.linear_iterations(), "Krylov iteration");
  }
  if (propagator.used() == v1::PROPAGATOR_KIND_ITERATIVE_STEPPING) {
    text += ", " + Count(propagator.set_changes(), "change") + " of active sets";
  }
  if (propagator.error() > 0) text += fmt::format(", error {:.1e}", propagator.error());
  if (!propagator.reason().empty()) text += ": " + propagator.reason();
  Paragraphs(width, out).Print("  ", text);
}

// Memory; only printed if it is large.
void PrintMemory(const v1::Cost& cost, std::FILE* out) {
  constexpr double kMuch = 1e8;
  if (std::max(cost.predicted_bytes(), cost.process_peak_bytes()) < kMuch) return;
  fmt::print(out, "Memory: {:.2g} GB at most in the process that solved, so far", 1e-9 * cost.process_peak_bytes());
  if (cost.predicted_bytes() > 0)
    fmt::print(out, ", {:.2g} GB predicted for this solve", 1e-9 * cost.predicted_bytes());
  fmt::print(out, "\n");
}

// Counts and times: "...; 0.01 s (...)". Counts of 0 windows are left out.
void PrintCost(const v1::Cost& cost, int width, std::FILE* out) {
  if (cost.lcps() == 0) {  // ended before its first step, or without a count
    fmt::print(out, "\n{:.2g} s\n", cost.seconds_total());
    return;
  }
  std::string counts = Count(cost.steps(), "step");
  if (cost.windows() > 0) counts += ", " + Count(cost.windows(), "window");
  if (cost.iterations() > 0) counts += ", " + Count(cost.iterations(), "iteration");
  counts += ", " + Count(cost.lcps(), "LCP");
  if (cost.coupled_steps() > 0) counts += fmt::format(", {} coupled", Count(cost.coupled_steps(), "step"));
  std::string seconds = fmt::format("{:.2g} s set-up", cost.seconds_setup());
  if (cost.seconds_lcp() > 0) seconds += fmt::format(", {:.2g} s LCPs", cost.seconds_lcp());
  if (cost.seconds_linear() > 0) seconds += fmt::format(", {:.2g} s linear algebra", cost.seconds_linear());
  if (cost.seconds_certificate() > 0) seconds += fmt::format(", {:.2g} s certificate", cost.seconds_certificate());
  fmt::print(out, "\n");
  Paragraphs(width, out).Print("", fmt::format("{}; {:.2g} s ({})", counts, cost.seconds_total(), seconds));
}

// Whether a sentence is a part of a text, but for its first letter and its period.
bool Says(const std::string& text, std::string_view sentence) {
  if (!sentence.empty() && sentence.back() == '.') sentence.remove_suffix(1);
  return sentence.size() > 1 && text.find(sentence.substr(1)) != std::string::npos;
}

}  // namespace

void PrintTable(const std::string& name, const SolveResult& result, int width, std::FILE* out) {
  const v1::Summary& summary = result.summary;
  const std::string verdict = VerdictText(summary);
  fmt::print(out, "{}: {}\n", name, verdict);
  Paragraphs paper(width, out);
  const auto print_unless_said = [&](const char* kind, const std::string& sentence) {
    if (!Says(verdict, sentence)) paper.Print(kind, sentence);
  };
  if (!summary.message().empty()) paper.Print("", summary.message());
  // A refused problem has no method and no steps to report.
  const bool refused = summary.termination() == v1::TERMINATION_UNSUPPORTED && summary.cost().lcps() == 0;
  if (!refused)
    paper.Print("", fmt::format("Method {}{}{}", Word(summary.method()), summary.reason().empty() ? "" : ": ",
                                summary.reason()));
  for (const std::string& concern : summary.verdict().concerns()) print_unless_said("Warning: ", concern);
  for (const std::string& warning : summary.warnings()) paper.Print("Warning: ", warning);
  for (const std::string& note : summary.verdict().notes()) print_unless_said("Note: ", note);
  if (!result.times.empty()) {
    PrintColumns(MakeColumns(result), result.times.size(), static_cast<std::size_t>(width), out);
  }
  PrintMeasurements(summary, width, out);
  PrintPeriodic(result, width, out);
  PrintJumps(summary, out);
  PrintSwitchings(summary, result.names, out);
  if (!result.times.empty()) {
    PrintCertificate(summary.certificate(), out);
    PrintAccuracy(summary.accuracy(), out);
  }
  PrintNewton(summary, out);
  PrintContours(summary, out);
  PrintPropagator(summary, width, out);
  if (!refused) PrintCost(summary.cost(), width, out);
  PrintMemory(summary.cost(), out);
}

}  // namespace dlcs::client
