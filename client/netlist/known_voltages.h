// SPDX-License-Identifier: Apache-2.0
// The voltages that independent sources alone determine.

#ifndef DLCS_CLIENT_NETLIST_KNOWN_VOLTAGES_H_
#define DLCS_CLIENT_NETLIST_KNOWN_VOLTAGES_H_

#include <optional>
#include <vector>

#include "core/circuits/circuit.h"

namespace dlcs::client {

// A quantity that is a function of time alone, whatever the circuit does.
struct KnownQuantity {
  std::optional<double> constant = {};  // its value, if that is always the same
};

// Nodes that paths of voltage sources join: the voltage between them is a sum of the functions of these.
class KnownVoltages {
 public:
  explicit KnownVoltages(const Circuit& circuit);

  // The voltage between two nodes of the circuit; absent if it depends on more than sources.
  std::optional<KnownQuantity> Between(Index plus, Index minus) const;

 private:
  // A forest of nodes: of each the one above it, or itself at the top, and the voltage to that.
  struct Joined {
    std::vector<Index> above;
    std::vector<double> volts;
    std::vector<Index> size;  // of a tree, at its top

    explicit Joined(Index nodes);
    struct Place {
      Index top;
      double volts;  // from the node to the top
    };
    Place Of(Index node) const;
    void Join(Index plus, Index minus, double difference);
  };

  Joined by_constants_, by_all_;  // in the second one volts mean nothing
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_KNOWN_VOLTAGES_H_
