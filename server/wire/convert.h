// SPDX-License-Identifier: Apache-2.0
// Wire messages <-> structs of the engine. Pure functions; the engine knows no wire types.
//
// On the wire matrices are row-major and time functions component-fastest; Eigen stores columns.
//
// The functions that read append to `violations` what cannot be converted: counts that do not match a shape,
// a oneof that is not set, an enum value that this version does not know. The value returned for such a field
// is empty. Everything else (shapes that do not fit together, NaN, order of times) is left to Validate().
// Fields are named as in problem files: "M", "f.pieces[0].samples", "T", "output_times"; an empty list says
// that everything was converted.

#ifndef DLCS_SERVER_WIRE_CONVERT_H_
#define DLCS_SERVER_WIRE_CONVERT_H_

#include <string>
#include <vector>

#include "core/analyze.h"
#include "core/ensemble.h"
#include "core/lcp/dynamic_lcp.h"
#include "core/lcp/lcp.h"
#include "core/outputs/output_evaluator.h"
#include "core/problem/nonlinear_problem.h"
#include "core/problem/observer.h"
#include "core/problem/options.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"
#include "dlcs/v1/solver.pb.h"
#include "server/wire/component_names.h"

namespace dlcs {

// A matrix with its structure. Entries that are formulas are evaluated with `parameters`, and refused if these are null
// (for matrices that are not part of a problem). Declared sizes are checked before anything is allocated: rows and
// columns against 2^31 - 1 here, and against the limits of the server in request_check.h.
StructuredMatrix StructuredMatrixFromProto(const v1::Matrix& matrix, const std::string& field,
                                           std::vector<Violation>& violations,
                                           const FormulaParameters* parameters = nullptr);
// All entries, whatever the structure on the wire; at most StructuredMatrix::kMaxDenseEntries.
Matrix MatrixFromProto(const v1::Matrix& matrix, const std::string& field, std::vector<Violation>& violations,
                       const FormulaParameters* parameters = nullptr);
TimeFunction TimeFunctionFromProto(const v1::TimeFunction& function, Index size, const std::string& field,
                                   std::vector<Violation>& violations, const FormulaParameters& parameters = {});
SolutionRule RuleFromProto(v1::SolutionRule rule, std::vector<Violation>& violations);
// Of LCPs with n pairs.
Selector SelectorFromProto(const v1::Selector& selector, Index n, std::vector<Violation>& violations);
// Of a problem with m states and n pairs.
Outputs OutputsFromProto(const v1::Outputs& outputs, Index m, Index n, std::vector<Violation>& violations,
                         const FormulaParameters& parameters);
std::vector<Measurement> MeasurementsFromProto(const google::protobuf::RepeatedPtrField<v1::Measurement>& measurements,
                                               std::vector<Violation>& violations);
Problem ProblemFromProto(const v1::Problem& problem, std::vector<Violation>& violations);
// A member of an ensemble of `base`. Where it has parameters of its own, f, g and h of the base that are formulas
// become its own.
EnsembleMember MemberFromProto(const v1::EnsembleMember& member, const v1::Problem& base, const std::string& field,
                               std::vector<Violation>& violations);
NonlinearProblem NonlinearProblemFromProto(const v1::NonlinearProblem& problem, std::vector<Violation>& violations);
// For a system with m states and n pairs. `step`, `steps` must be positive and `grid_times` not empty if set: the
// engine reads 0 and none as not set.
Options OptionsFromProto(const v1::SolveOptions& options, const ComponentNames& names, Index m, Index n,
                         std::vector<Violation>& violations);

v1::Matrix ToProto(const Matrix& matrix);
v1::Matrix ToProto(const StructuredMatrix& matrix);
v1::TimeFunction ToProto(const TimeFunction& function);
v1::Outputs ToProto(const Outputs& outputs);
v1::Measurement ToProto(const Measurement& measurement);
v1::MeasurementResult ToProto(const MeasurementResult& measured);
v1::Problem ToProto(const Problem& problem);
v1::SolveOptions ToProto(const Options& options, const ComponentNames& names = {});
v1::Method ToProto(Method method);
v1::PropagatorKind ToProto(PropagatorKind propagator);
v1::Termination ToProto(Termination termination);
v1::Analysis ToProto(const AnalysisReport& report, const ComponentNames& names = {});
v1::WindowStarted ToProto(const WindowReport& report);
v1::Iterate ToProto(const IterateReport& report);
v1::WindowFinished ToProto(const WindowOutcome& outcome);
v1::SolveLcpResponse ToProto(const LcpResult& result);

// `path` with n components at each time.
PiecewiseLinearPath PathFromProto(const v1::PiecewiseLinearPath& path, Index n, const std::string& field,
                                  std::vector<Violation>& violations);
v1::PiecewiseLinearPath ToProto(const PiecewiseLinearPath& path);
v1::DcpCertificate ToProto(const DcpCertificate& certificate);

v1::Finding ToProto(const Finding& finding);
v1::AnalysisSection ToProto(const AnalysisSection& section);
v1::AnalyzeProblemResponse ToProto(const Analysis& analysis);

// Times `first` to `first + count - 1` of the trajectory, with `outputs` if they are not null.
v1::TrajectoryChunk ChunkToProto(const Solution& solution, Index first, Index count,
                                 OutputEvaluator* outputs = nullptr);
// Everything but the trajectory.
v1::Summary SummaryToProto(const Solution& solution);

// The name on the wire of an option that Validate(Options) calls `core_field`: "num_steps" is "steps", "contour_mu" is
// "contour.mu"; an index after it is kept.
std::string WireOptionName(const std::string& core_field);

}  // namespace dlcs

#endif  // DLCS_SERVER_WIRE_CONVERT_H_
