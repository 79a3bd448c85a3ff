// SPDX-License-Identifier: Apache-2.0
#include "server/wire/convert.h"
#include "server/wire/convert_dense.h"

namespace dlcs {
namespace {

v1::LcpStatus ToProto(LcpStatus verdict) {
  switch (verdict) {
    case LcpStatus::kSolved:
      return v1::LCP_STATUS_SOLVED;
    case LcpStatus::kInfeasible:
      return v1::LCP_STATUS_INFEASIBLE;
    case LcpStatus::kRay:
      return v1::LCP_STATUS_RAY;
    case LcpStatus::kPivotLimit:
      return v1::LCP_STATUS_PIVOT_LIMIT;
    case LcpStatus::kSingular:
      return v1::LCP_STATUS_SINGULAR;
    case LcpStatus::kNonFinite:
      return v1::LCP_STATUS_NON_FINITE;
  }
  return v1::LCP_STATUS_UNSPECIFIED;
}

using Indices = google::protobuf::RepeatedField<google::protobuf::int32>;

void AppendIndices(const std::vector<Index>& indices, Indices& wire) {
  for (const Index i : indices) wire.Add(static_cast<int>(i));
}

v1::IndexSets ToProto(const IndexSets& sets) {
  v1::IndexSets result;
  AppendIndices(sets.J, *result.mutable_j());
  AppendIndices(sets.I, *result.mutable_i());
  AppendIndices(sets.K, *result.mutable_k());
  return result;
}

v1::BasicSolutions ToProto(const BasicSolutions& all) {
  v1::BasicSolutions result;
  for (const BasicSolution& solution : all.solutions) {
    v1::BasicSolution& out = *result.add_solutions();
    Append(solution.y, *out.mutable_y());
    Append(solution.w, *out.mutable_w());
    *out.mutable_sets() = ToProto(solution.sets);
    AppendIndices(solution.basis, *out.mutable_basis());
    out.set_bases(solution.num_bases);
  }
  for (const SolutionFace& face : all.faces) {
    v1::SolutionFace& out = *result.add_faces();
    AppendIndices(face.basis, *out.mutable_basis());
    Append(face.nearest, *out.mutable_nearest());
    out.set_point(face.point);
  }
  result.set_complete(all.complete);
  return result;
}

}  // namespace

v1::SolveLcpResponse ToProto(const LcpResult& lcp) {
  v1::SolveLcpResponse result;
  result.set_verdict(ToProto(lcp.verdict));
  result.set_pivots(lcp.pivots);
  result.set_method(lcp.method);
  result.set_message(lcp.message);
  result.set_matrix_class(lcp.matrix_class);
  result.set_rule(SelectionName(lcp.selection));
  if (lcp.verdict == LcpStatus::kSolved) {
    Append(lcp.y, *result.mutable_y());
    Append(lcp.w, *result.mutable_w());
    result.set_residual(lcp.residual);
    *result.mutable_sets() = ToProto(lcp.sets);
    result.set_only_choice(lcp.only_choice);
  }
  if (lcp.basic_solutions) *result.mutable_all() = ToProto(*lcp.basic_solutions);
  return result;
}

}  // namespace dlcs
