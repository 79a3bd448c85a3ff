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
      return "waveform relaxation by windows, in parallel over times; order 2; M a P- or Z-matrix";
    case Method::kWuChenIteration:
      return "the iteration of Wu & Chen as printed, a contour for every time; A sectorial, modest numbers of steps";
    case Method::kExponentialIntegrator:
      return "one step at a time, with exact exponentials of A; order 2 where y is Lipschitz, otherwise order 1";
    case Method::kTimeStepping:
      return "the theta scheme, with inconsistent states projected; order 1; any class of M";
    case Method::kEventDriven:
      return "steps of order 12 between switching times, which are found to rounding; any class of M, some hundreds "
             "of states";
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
