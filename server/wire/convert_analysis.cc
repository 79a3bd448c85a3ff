// SPDX-License-Identifier: Apache-2.0
#include "core/analyze.h"
#include "server/wire/convert.h"

namespace dlcs {
namespace {

v1::Answer ToProto(Answer answer) {
  switch (answer) {
    case Answer::kNo:
      return v1::ANSWER_NO;
    case Answer::kYes:
      return v1::ANSWER_YES;
    case Answer::kUnknown:
      return v1::ANSWER_UNKNOWN;
  }
  return v1::ANSWER_UNSPECIFIED;
}

v1::ConstantKind ToProto(ConstantKind kind) {
  switch (kind) {
    case ConstantKind::kExact:
      return v1::CONSTANT_KIND_EXACT;
    case ConstantKind::kUpperBound:
      return v1::CONSTANT_KIND_UPPER_BOUND;
    case ConstantKind::kLowerBound:
      return v1::CONSTANT_KIND_LOWER_BOUND;
    case ConstantKind::kEstimate:
      return v1::CONSTANT_KIND_ESTIMATE;
  }
  return v1::CONSTANT_KIND_UNSPECIFIED;
}

v1::Witness ToProto(const Witness& witness) {
  v1::Witness result;
  for (const Index i : witness.indices) result.add_indices(static_cast<int>(i));
  if (witness.value) result.set_value(*witness.value);
  result.mutable_z()->Add(witness.z.begin(), witness.z.end());
  if (witness.X.size() > 0) *result.mutable_x() = dlcs::ToProto(witness.X);
  if (witness.Y.size() > 0) *result.mutable_y() = dlcs::ToProto(witness.Y);
  result.mutable_r()->Add(witness.r.begin(), witness.r.end());
  result.mutable_s()->Add(witness.s.begin(), witness.s.end());
  return result;
}

v1::Constant ToProto(const Constant& constant) {
  v1::Constant result;
  result.set_id(constant.id);
  result.set_symbol(constant.symbol);
  result.set_title(constant.title);
  if (constant.value) result.set_value(*constant.value);
  result.set_kind(ToProto(constant.kind));
  result.set_reason(constant.why);
  result.set_source(constant.source);
  return result;
}

}  // namespace

v1::Finding ToProto(const Finding& finding) {
  v1::Finding result;
  result.set_id(finding.id);
  result.set_title(finding.title);
  result.set_answer(ToProto(finding.fact.answer));
  result.set_reason(finding.fact.why);
  if (!finding.fact.witness.empty()) *result.mutable_witness() = ToProto(finding.fact.witness);
  result.set_source(finding.source);
  return result;
}

v1::AnalysisSection ToProto(const AnalysisSection& section) {
  v1::AnalysisSection result;
  result.set_id(section.id);
  result.set_title(section.title);
  for (const Finding& finding : section.findings) *result.add_findings() = ToProto(finding);
  for (const Constant& constant : section.constants) *result.add_constants() = ToProto(constant);
  result.mutable_warnings()->Add(section.warnings.begin(), section.warnings.end());
  return result;
}

v1::AnalyzeProblemResponse ToProto(const Analysis& analysis) {
  v1::AnalyzeProblemResponse result;
  result.set_states(static_cast<int>(analysis.num_states));
  result.set_constraints(static_cast<int>(analysis.num_constraints));
  result.set_horizon(analysis.horizon);
  result.set_matrix_class(analysis.matrix_class);
  result.set_rule(analysis.rule);
  for (const AnalysisSection& section : analysis.sections) *result.add_sections() = ToProto(section);
  v1::Recommendation& recommendation = *result.mutable_recommendation();
  *recommendation.mutable_options() = ToProto(analysis.recommendation.options);
  recommendation.mutable_reasons()->Add(analysis.recommendation.reasons.begin(), analysis.recommendation.reasons.end());
  recommendation.set_refusal(analysis.recommendation.refusal);
  result.mutable_warnings()->Add(analysis.warnings.begin(), analysis.warnings.end());
  result.set_seconds(analysis.seconds);
  return result;
}

}  // namespace dlcs
