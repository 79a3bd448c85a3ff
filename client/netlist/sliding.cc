// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/sliding.h"

#include <fmt/format.h>

#include <set>
#include <string>

namespace dlcs::client {
namespace {

struct SlidingTime {
  double begin = 0, seconds = 0;
};

// The total time at which neither diode of `relay` conducts.
SlidingTime BetweenOf(const Relay& relay, double end, const v1::Summary& summary) {
  SlidingTime sliding;
  std::set<int> active;
  const auto conducts = [&](const Relay::OneWay& one) {
    return active.contains(static_cast<int>(one.pair)) == one.conducts_active;
  };
  for (int k = 0; k < summary.switching_times_size(); ++k) {
    const v1::SwitchingTime& switching = summary.switching_times(k);
    active.insert(switching.entering().begin(), switching.entering().end());
    for (const int pair : switching.leaving()) active.erase(pair);
    if (switching.kind() == v1::SWITCHING_KIND_COUPLED_STEPS_BEGIN) continue;  // active sets are not known there
    if (conducts(relay.low) || conducts(relay.high)) continue;
    if (sliding.seconds == 0) sliding.begin = switching.time();
    const bool is_last = k + 1 == summary.switching_times_size();
    sliding.seconds += (is_last ? end : summary.switching_times(k + 1).time()) - switching.time();
  }
  return sliding;
}

}  // namespace

void AddSlidingConcerns(const std::vector<Relay>& relays, double horizon, v1::Summary& summary) {
  constexpr double kRounding = 1e-9;  // of the horizon
  const double end = summary.has_failure_time() ? summary.failure_time() : horizon;
  v1::Verdict& verdict = *summary.mutable_verdict();
  std::set<std::string> reported;  // an expression may be made of several relays
  for (const Relay& relay : relays) {
    const SlidingTime sliding = BetweenOf(relay, end, summary);
    if (!(sliding.seconds > kRounding * horizon) || !reported.insert(relay.element).second) continue;
    const char* const advice =
        relay.has_hysteresis ? "Its hysteresis does not allow that: what it does acts on its control at once, and "
                               "the result is not that of the circuit. A delay in the control makes it switch."
                             : "A hysteresis or a delay makes it switch.";
    verdict.add_concerns(fmt::format(
        "{} slides from t = {:.6g} on, for {:.3g} s in all: it rests between {}, with its control at the threshold, as "
        "if it switched infinitely often. {}",
        relay.element, sliding.begin, sliding.seconds, relay.is_switch ? "open and closed" : "its two values", advice));
    if (relay.has_hysteresis) verdict.set_success(false);
    // Some readers see the first line alone.
    if (verdict.kind() == v1::VERDICT_KIND_NOT_SOLVED) continue;
    verdict.set_kind(v1::VERDICT_KIND_ERROR_ESTIMATED);
    verdict.set_text(
        fmt::format("reached T: {} slides, estimated error {:.2g}", relay.element, summary.accuracy().error()));
  }
}

}  // namespace dlcs::client
