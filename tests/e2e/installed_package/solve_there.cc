// SPDX-License-Identifier: Apache-2.0
// The same system, on the server at argv[1].
#include <cstdio>

#include "client/files/problem_file.h"
#include "client/rpc/client.h"

int main(int, char** argv) {
  const auto file = dlcs::client::ParseProblem(
      R"({"A": [[0]], "B": [[1]], "N": [[1]], "M": [[1]], "f": [-1], "x0": [1], "T": 2})", "the system");
  const auto client = dlcs::client::Client::Connect(argv[1]);
  if (!file.ok() || !client.ok()) return 1;
  dlcs::v1::SolveRequest request;
  *request.mutable_problem() = file->problem;
  const auto result = (*client)->Solve(request, {}, {});
  if (!result.ok() || result->summary.termination() != dlcs::v1::TERMINATION_REACHED_END) return 1;
  std::printf("%.17g\n", result->x.back());
}
