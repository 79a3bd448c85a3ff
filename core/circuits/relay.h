// SPDX-License-Identifier: Apache-2.0
// The pairs of switches and comparators that jump between two states.

#ifndef DLCS_CORE_CIRCUITS_RELAY_H_
#define DLCS_CORE_CIRCUITS_RELAY_H_

#include <cstddef>
#include <string>

namespace dlcs {

// A switch or a comparator of a circuit that jumps between two states. While neither of its diodes conducts, it is
// between the states: it slides, as if it switched infinitely often.
struct Relay {
  // A pair. Its diode conducts while the pair is active, or while it is not.
  struct OneWay {
    std::ptrdiff_t pair = 0;
    bool conducts_active = true;
  };
  std::string element;
  bool is_switch = false;
  bool has_hysteresis = false;  // it should then never slide
  OneWay low, high;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_RELAY_H_
