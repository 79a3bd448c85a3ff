// SPDX-License-Identifier: Apache-2.0
// Requests as the server processes them: converted, compared with the limits, validated. Nothing is solved.
#include <google/protobuf/util/message_differencer.h>

#include "dlcs/v1/solver.pb.h"
#include "server/session/ensemble_session.h"
#include "server/session/solve_session.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/message_text.h"
#include "tests/fuzz/small_limits.h"

namespace dlcs::fuzz {
namespace {

void RequireToldWell(const absl::Status& status) {
  const bool known = absl::IsInvalidArgument(status) || absl::IsResourceExhausted(status);
  Require(known, "a refusal is INVALID_ARGUMENT or RESOURCE_EXHAUSTED");
  // More is lost in the metadata of gRPC.
  Require(status.message().size() <= kMaxMessageBytes + 100, "a refusal is short");
  if (absl::IsInvalidArgument(status)) Require(!ViolationsOf(status).empty(), "a refusal names a field");
}

// Converting the input of the engine back to the wire gives the same message.
void RequireRoundTrip(const Problem& problem) {
  const v1::Problem first = ToProto(problem);
  std::vector<Violation> violations;
  const v1::Problem second = ToProto(ProblemFromProto(first, violations));
  Require(violations.empty(), "a sound problem is converted back");
  Require(first.SerializeAsString() == second.SerializeAsString(), "and is the same");
}

void TryPrepareSolve(const v1::SolveRequest& request) {
  const absl::StatusOr<PreparedSolve> prepared = PrepareSolve(request, SmallLimits());
  if (!prepared.ok()) return RequireToldWell(prepared.status());
  if (const auto* problem = std::get_if<Problem>(&prepared->system)) RequireRoundTrip(*problem);
}

void TryPrepareEnsemble(const v1::SolveEnsembleRequest& request) {
  const absl::StatusOr<PreparedEnsemble> prepared = PrepareEnsemble(request, SmallLimits());
  if (!prepared.ok()) RequireToldWell(prepared.status());
}

}  // namespace

void TryRequest(const std::string& input) {
  const auto message = MessageOf(input);
  if (const auto* solve = dynamic_cast<const v1::SolveRequest*>(message.get())) TryPrepareSolve(*solve);
  if (const auto* ensemble = dynamic_cast<const v1::SolveEnsembleRequest*>(message.get()))
    TryPrepareEnsemble(*ensemble);
}

}  // namespace dlcs::fuzz
