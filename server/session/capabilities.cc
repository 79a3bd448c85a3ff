// SPDX-License-Identifier: Apache-2.0
#include "server/session/capabilities.h"

#include "core/problem/options.h"
#include "core/problem/solution.h"
#include "server/session/version.h"
#include "server/wire/convert.h"

namespace dlcs {
namespace {

const char* Describe(Method method) {
  switch (method) {
    case Method::kAuto:
      return "chosen from the class of M, with the reason";
    case Method::kLaplaceIteration:
      return "Wu & Chen's iteration in reduced space, windowed and parallel over time points; order 2; M a "
             "P- or "
             "Z-matrix";
    case Method::kWuChenIteration:
      return "Wu & Chen's iteration exactly as printed, one contour per time point; A sectorial, modest "
             "numbers "
             "of steps";
    case Method::kExponentialIntegrator:
      return "the same fixed point marched step by step; order 2 where y is Lipschitz, otherwise order 1";
    case Method::kTimeStepping:
      return "theta scheme by substitution, projects inconsistent states; order 1; any class of M";
    case Method::kEventDriven:
      return "switching times located, steps of order 12 between them; a tolerance instead of a step; modest "
             "numbers of states";
  }
  return "";
}

}  // namespace

v1::GetCapabilitiesResponse CommonCapabilities() {
  v1::GetCapabilitiesResponse response;
  response.set_version(kVersion);
  response.set_build(BuildText());
  for (const Method method : {Method::kAuto, Method::kLaplaceIteration, Method::kWuChenIteration,
                              Method::kExponentialIntegrator, Method::kTimeStepping, Method::kEventDriven}) {
    auto& info = *response.add_methods();
    info.set_method(ToProto(method));
    info.set_name(MethodName(method));
    info.set_description(Describe(method));
  }
  return response;
}

}  // namespace dlcs
