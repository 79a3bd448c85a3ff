// SPDX-License-Identifier: Apache-2.0
#include "client/names.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <cctype>
#include <string_view>

namespace dlcs::client {
namespace {

// The name of an enumerator without `prefix`; what this build does not know (the other end is newer) is
// called by its number.
std::string BareName(const google::protobuf::EnumDescriptor& enumeration, int number,
                     std::string_view prefix) {
  const auto* value = enumeration.FindValueByNumber(number);
  if (value == nullptr) return fmt::format("{}{}", prefix, number);
  const std::string& name = value->name();
  return name.rfind(prefix, 0) == 0 ? name.substr(prefix.size()) : name;
}

// "LAPLACE_ITERATION" -> "laplace-iteration". Number 0, the unspecified one, is the automatic choice.
std::string WordName(const google::protobuf::EnumDescriptor& enumeration, int number,
                     std::string_view prefix) {
  if (number == 0) return "auto";
  std::string name = BareName(enumeration, number, prefix);
  for (char& c : name) c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

std::vector<std::string> WordNames(const google::protobuf::EnumDescriptor& enumeration,
                                   std::string_view prefix) {
  std::vector<std::string> names;
  for (int i = 0; i < enumeration.value_count(); ++i) {
    names.push_back(WordName(enumeration, enumeration.value(i)->number(), prefix));
  }
  return names;
}

template <typename Enum>
std::optional<Enum> Parse(const google::protobuf::EnumDescriptor& enumeration, const std::string& word,
                          std::string_view prefix) {
  for (int i = 0; i < enumeration.value_count(); ++i) {
    const int number = enumeration.value(i)->number();
    if (WordName(enumeration, number, prefix) == word) return static_cast<Enum>(number);
  }
  return std::nullopt;
}

constexpr std::string_view kMethodPrefix = "METHOD_";
constexpr std::string_view kRulePrefix = "SOLUTION_RULE_";
constexpr std::string_view kStepSolverPrefix = "STEP_SOLVER_";
constexpr std::string_view kKernelSourcePrefix = "KERNEL_SOURCE_";
constexpr std::string_view kRealisationPrefix = "REALISATION_";
constexpr std::string_view kInterpolationPrefix = "INTERPOLATION_";
constexpr std::string_view kContourChoicePrefix = "CONTOUR_CHOICE_";

}  // namespace

std::string MethodName(v1::Method method) {
  return WordName(*v1::Method_descriptor(), method, kMethodPrefix);
}

std::optional<v1::Method> ParseMethod(const std::string& name) {
  return Parse<v1::Method>(*v1::Method_descriptor(), name, kMethodPrefix);
}

std::vector<std::string> MethodNames() { return WordNames(*v1::Method_descriptor(), kMethodPrefix); }

std::string RuleName(v1::SolutionRule rule) {
  return WordName(*v1::SolutionRule_descriptor(), rule, kRulePrefix);
}

std::optional<v1::SolutionRule> ParseRule(const std::string& name) {
  return Parse<v1::SolutionRule>(*v1::SolutionRule_descriptor(), name, kRulePrefix);
}

std::vector<std::string> RuleNames() { return WordNames(*v1::SolutionRule_descriptor(), kRulePrefix); }

std::string StepSolverName(v1::StepSolver step_solver) {
  return WordName(*v1::StepSolver_descriptor(), step_solver, kStepSolverPrefix);
}

std::optional<v1::StepSolver> ParseStepSolver(const std::string& name) {
  return Parse<v1::StepSolver>(*v1::StepSolver_descriptor(), name, kStepSolverPrefix);
}

std::vector<std::string> StepSolverNames() {
  return WordNames(*v1::StepSolver_descriptor(), kStepSolverPrefix);
}

std::string KernelSourceName(v1::KernelSource kernel) {
  return WordName(*v1::KernelSource_descriptor(), kernel, kKernelSourcePrefix);
}

std::optional<v1::KernelSource> ParseKernelSource(const std::string& name) {
  return Parse<v1::KernelSource>(*v1::KernelSource_descriptor(), name, kKernelSourcePrefix);
}

std::vector<std::string> KernelSourceNames() {
  return WordNames(*v1::KernelSource_descriptor(), kKernelSourcePrefix);
}

std::string RealisationName(v1::Realisation realisation) {
  return WordName(*v1::Realisation_descriptor(), realisation, kRealisationPrefix);
}

std::optional<v1::Realisation> ParseRealisation(const std::string& name) {
  return Parse<v1::Realisation>(*v1::Realisation_descriptor(), name, kRealisationPrefix);
}

std::vector<std::string> RealisationNames() {
  return WordNames(*v1::Realisation_descriptor(), kRealisationPrefix);
}

std::string InterpolationName(v1::Interpolation interpolation) {
  return WordName(*v1::Interpolation_descriptor(), interpolation, kInterpolationPrefix);
}

std::optional<v1::Interpolation> ParseInterpolation(const std::string& name) {
  return Parse<v1::Interpolation>(*v1::Interpolation_descriptor(), name, kInterpolationPrefix);
}

std::vector<std::string> InterpolationNames() {
  return WordNames(*v1::Interpolation_descriptor(), kInterpolationPrefix);
}

std::string ContourChoiceName(v1::ContourChoice choice) {
  return WordName(*v1::ContourChoice_descriptor(), choice, kContourChoicePrefix);
}

std::optional<v1::ContourChoice> ParseContourChoice(const std::string& name) {
  return Parse<v1::ContourChoice>(*v1::ContourChoice_descriptor(), name, kContourChoicePrefix);
}

std::vector<std::string> ContourChoiceNames() {
  return WordNames(*v1::ContourChoice_descriptor(), kContourChoicePrefix);
}

std::string TerminationName(v1::Termination termination) {
  return BareName(*v1::Termination_descriptor(), termination, "TERMINATION_");
}

std::string VerdictName(const v1::Summary& summary) {
  if (summary.termination() != v1::REACHED_END) return TerminationName(summary.termination());
  return BareName(*v1::VerdictKind_descriptor(), summary.verdict().kind(), "VERDICT_KIND_");
}

std::string VerdictText(const v1::Summary& summary) {
  if (summary.termination() != v1::REACHED_END) return TerminationName(summary.termination());
  return summary.verdict().text();
}

std::string AccuracySourceName(v1::AccuracySource source) {
  if (source == v1::ACCURACY_SOURCE_UNSPECIFIED) return "not estimated";
  return WordName(*v1::AccuracySource_descriptor(), source, "ACCURACY_SOURCE_");
}

bool Succeeded(const v1::Summary& summary) { return summary.verdict().success(); }

std::string AnswerName(v1::Answer answer) { return WordName(*v1::Answer_descriptor(), answer, "ANSWER_"); }

std::string ConstantKindName(v1::ConstantKind kind) {
  return WordName(*v1::ConstantKind_descriptor(), kind, "CONSTANT_KIND_");
}

std::string VerdictName(v1::LcpVerdict verdict) {
  const std::string name = BareName(*v1::LcpVerdict_descriptor(), verdict, "LCP_");
  return name == "VERDICT_UNSPECIFIED" ? "UNSPECIFIED" : name;
}

}  // namespace dlcs::client
