// SPDX-License-Identifier: Apache-2.0
// The enumerations of the wire in the words of files and of the command line.

#ifndef DLCS_CLIENT_NAMES_H_
#define DLCS_CLIENT_NAMES_H_

#include <optional>
#include <string>
#include <vector>

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// "auto", "laplace-iteration", "paper-iteration", ...; a method of a newer server is "method-<number>".
std::string MethodName(v1::Method method);
std::optional<v1::Method> ParseMethod(const std::string& name);
std::vector<std::string> MethodNames();

// "auto", "unique", "least-element".
std::string RuleName(v1::SolutionRule rule);
std::optional<v1::SolutionRule> ParseRule(const std::string& name);
std::vector<std::string> RuleNames();

// "auto", "substitution", "newton".
std::string StepSolverName(v1::StepSolver step_solver);
std::optional<v1::StepSolver> ParseStepSolver(const std::string& name);
std::vector<std::string> StepSolverNames();

// "auto", "phi-functions", "contour".
std::string KernelSourceName(v1::KernelSource kernel);
std::optional<v1::KernelSource> ParseKernelSource(const std::string& name);
std::vector<std::string> KernelSourceNames();

// "auto", "dense", "kronecker-sum", "contour", "sparse-stepping".
std::string RealisationName(v1::Realisation realisation);
std::optional<v1::Realisation> ParseRealisation(const std::string& name);
std::vector<std::string> RealisationNames();

// "auto", "linear", "cubic-spline".
std::string InterpolationName(v1::Interpolation interpolation);
std::optional<v1::Interpolation> ParseInterpolation(const std::string& name);
std::vector<std::string> InterpolationNames();

// "auto", "theorem-2-2", "remark-2-4".
std::string ContourChoiceName(v1::ContourChoice choice);
std::optional<v1::ContourChoice> ParseContourChoice(const std::string& name);
std::vector<std::string> ContourChoiceNames();

// "REACHED_END", "INFEASIBLE", ...
std::string TerminationName(v1::Termination termination);
// "SOLVED", "ERROR_ESTIMATED", "ERROR_UNKNOWN"; of what was not solved how it ended, "INFEASIBLE".
std::string VerdictName(const v1::Summary& summary);
// The same for people, with the figure: "SOLVED within an error of 1e-08, estimated error 2e-10".
std::string VerdictText(const v1::Summary& summary);
// "not estimated", "compared", "controlled".
std::string AccuracySourceName(v1::AccuracySource source);
// Whether the answer may be used.
bool Succeeded(const v1::Summary& summary);

// "yes", "no", "unknown".
std::string AnswerName(v1::Answer answer);

// "exact", "upper-bound", "lower-bound", "estimate".
std::string ConstantKindName(v1::ConstantKind kind);

// "SOLVED", "INFEASIBLE", ...
std::string VerdictName(v1::LcpVerdict verdict);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NAMES_H_
