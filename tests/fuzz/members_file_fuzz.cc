// SPDX-License-Identifier: Apache-2.0
// Files with the members of an ensemble, JSON or a table, for a problem of two states and a pair.
#include "client/files/members_file.h"
#include "server/session/ensemble_session.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_limits.h"

namespace dlcs::fuzz {
namespace {

v1::Matrix Dense(int rows, int columns) {
  v1::Matrix matrix;
  matrix.mutable_dense()->set_rows(rows);
  matrix.mutable_dense()->set_columns(columns);
  for (int k = 0; k < rows * columns; ++k) matrix.mutable_dense()->add_values(k + 1);
  return matrix;
}

v1::Problem BaseProblem() {
  v1::Problem problem;
  *problem.mutable_a() = Dense(2, 2);
  *problem.mutable_b() = Dense(2, 1);
  *problem.mutable_n() = Dense(1, 2);
  *problem.mutable_m() = Dense(1, 1);
  problem.mutable_f()->add_pieces()->mutable_formulas()->add_formulas("t");
  problem.mutable_f()->mutable_pieces(0)->mutable_formulas()->add_formulas("0");
  problem.mutable_g()->add_pieces()->mutable_constant()->add_values(1);
  problem.add_x0(0);
  problem.add_x0(0);
  problem.set_horizon(1);
  return problem;
}

}  // namespace

void TryMembersFile(const std::string& input) {
  const auto members = client::ParseMembers(input, "input", 2, 1);
  if (!members.ok()) return Require(!members.status().message().empty(), "a refusal says why");
  static const v1::Problem problem = BaseProblem();
  v1::SolveEnsembleRequest request;
  *request.mutable_problem() = problem;
  for (const v1::EnsembleMember& member : *members) *request.add_members() = member;
  (void)PrepareEnsemble(request, SmallLimits());
}

}  // namespace dlcs::fuzz
