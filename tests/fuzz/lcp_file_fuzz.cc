// SPDX-License-Identifier: Apache-2.0
// Files with one LCP, one DCP or a model, as `dlcs lcp`, `dlcs dcp` and `dlcs model` read them. Tiny problems are also
// solved.
#include "client/files/lcp_file.h"
#include "client/files/problem_file.h"
#include "client/local/model.h"
#include "server/session/call_session.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/small_limits.h"

namespace dlcs::fuzz {

void TryLcpFile(const std::string& input) {
  if (const auto lcp = client::ParseLcp(input, "input"); lcp.ok()) {
    v1::SolveLcpRequest request = *lcp;
    request.set_all_basic_solutions(true);
    (void)RunLcp(*lcp, TinyLimits(), {});
    (void)RunLcp(request, TinyLimits(), {});
  }
  if (const auto dcp = client::ParseDcp(input, "input"); dcp.ok()) (void)RunDcp(*dcp, TinyLimits(), {});
  // Analyzed as it is made: only with few sectors is it cheap.
  if (input.size() > 1000) return;
  if (const auto model = client::ModelInputOutput(input, "input"); model.ok()) {
    Require(client::ParseProblem(model->file.dump(), "made").ok(), "a model is a problem file");
  }
}

}  // namespace dlcs::fuzz
