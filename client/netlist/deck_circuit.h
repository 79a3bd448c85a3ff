// SPDX-License-Identifier: Apache-2.0
// The elements of a deck as a circuit, subcircuits expanded.

#ifndef DLCS_CLIENT_NETLIST_DECK_CIRCUIT_H_
#define DLCS_CLIENT_NETLIST_DECK_CIRCUIT_H_

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/netlist/deck_fields.h"
#include "client/netlist/deck_options.h"
#include "client/netlist/deck_parts.h"
#include "client/netlist/deck_values.h"
#include "client/netlist/known_voltages.h"
#include "client/netlist/spice_expression.h"
#include "core/circuits/circuit.h"

namespace dlcs::client {

inline std::size_t AsSize(Index index) { return static_cast<std::size_t>(index); }

class DeckCircuit {
 public:
  // `parts` and `notes` must outlive it.
  DeckCircuit(const DeckParts& parts, const DeckOptions& options, DeckNotes& notes)
      : parts_(parts), options_(options), notes_(notes) {
    circuit_.nodes = {"0"};
  }

  // Adds all elements; `step` and `stop` are those of .tran. Errors: InvalidArgument with the place.
  absl::Status AddAll(ParameterScope& global, double step, double stop);

  Circuit& circuit() { return circuit_; }
  // Sources outside of subcircuits rise from 0 (TurnedOn()). To be called before AddAll().
  void TurnSourcesOn() { turns_sources_on_ = true; }
  // By name in small letters, with the names of instances; -1 if there is none.
  Index NodeNamed(const std::string& lower) const;
  Index ElementNamed(const std::string& lower) const;
  // What may be meant by a node that does not exist, to be appended to an error: where the port of that name of a
  // subcircuit is, the nearest names, or the nodes of its subcircuit; empty if nothing is near.
  std::string HintOnNode(const std::string& lower) const;

 private:
  // A part of the circuit: the deck itself, or one instance of a subcircuit.
  struct Instance {
    std::string prefix;  // "X1." in front of names
    const DeckBody* body = nullptr;
    ParameterScope* scope = nullptr;
    std::map<std::string, Index> nodes;  // of its ports, in small letters
    const Instance* around = nullptr;    // where it is defined: models and subcircuits are looked up there too
    int depth = 0;
  };
  // A source or switch that the current of an element controls, and two inductors that are coupled: names that may be
  // used before they are defined.
  struct PendingControl {
    Index element;
    double factor;
    std::string name, place;
    bool by_any;  // by any element, not only by a voltage source
  };
  struct PendingCoupling {
    std::string name, one, other;
    double value;
    std::string one_place, other_place, value_place;
  };

  absl::StatusOr<double> Value(const DeckFields& fields, const DeckWord& word, const Instance& instance) {
    return ValueOf(*fields.line, word, *instance.scope, notes_);
  }

  // deck_circuit.cc
  Index NodeOf(const Instance& instance, const std::string& name);
  absl::Status Expand(const Instance& instance);
  absl::Status AddElement(const DeckLine& line, const Instance& instance);
  absl::Status SetInitial(const DeckLine& line, const Instance& instance);
  absl::Status CheckCount(const DeckFields& fields) const;
  absl::Status Store(Element element, const DeckFields& fields);
  // The element stored next is controlled by factor times the current of the voltage source in word `k`.
  void PendControl(const Instance& instance, const DeckFields& fields, std::size_t k, double factor);
  absl::Status AddInstance(const DeckFields& fields, const Instance& instance);
  absl::StatusOr<std::set<std::string>> GiveParameters(const DeckFields& fields, const Instance& instance,
                                                       const DeckSubcircuit& subcircuit, ParameterScope& scope);
  absl::Status ResolveControls();
  absl::Status ResolveCouplings();
  // What voltage sources anywhere in the deck make of a voltage as EvaluateLinear() names it.
  std::optional<KnownQuantity> KnownOf(const Instance& instance, const std::string& quantity);

  // deck_elements.cc
  absl::Status AddPassive(const DeckFields& fields, const Instance& instance, Element element, char kind);
  absl::StatusOr<DeckFields> WithoutModel(const DeckFields& fields, std::size_t k, const Instance& instance);
  void AddRatings(const DeckFields& fields, char kind, std::set<std::string>& known);
  // Those of each of `parallel` elements that are one.
  absl::Status AddParasitics(const DeckFields& fields, const Instance& instance, double parallel, Element& element);
  absl::Status AddCoupling(const DeckFields& fields, const Instance& instance);
  absl::Status AddSource(const DeckFields& fields, const Instance& instance, Element element, char kind);
  struct FoundModel {
    const DeckModel* model;
    ParameterScope* scope;  // where it is defined
  };
  bool HasModel(const Instance& instance, const DeckWord& word) const;
  absl::StatusOr<FoundModel> ModelOf(const DeckFields& fields, std::size_t k, const Instance& instance,
                                     const std::set<std::string>& types);
  absl::Status AddDiode(const DeckFields& fields, const Instance& instance, Element element);
  absl::Status AddSwitch(const DeckFields& fields, const Instance& instance, Element element, char kind);
  absl::Status AddTransistor(const DeckFields& fields, const Instance& instance, Element element);
  absl::StatusOr<double> NamedValue(const DeckFields& fields, const Instance& instance, const std::string& name,
                                    double otherwise);

  // deck_controlled.cc
  absl::Status AddControlled(const DeckFields& fields, const Instance& instance, Element element, char kind);
  absl::Status AddBehavioral(const DeckFields& fields, const Instance& instance, Element element);
  absl::Status AddPolynomial(const DeckFields& fields, const Instance& instance, Element element, bool by_voltage);
  absl::Status AddTable(const DeckFields& fields, const Instance& instance, Element element);
  // A voltage source of the formula `text` between a new node of the same name and ground: its voltage as a quantity.
  absl::StatusOr<std::string> AddFormula(const DeckFields& fields, const std::string& name, const std::string& place,
                                         const std::string& text);
  absl::StatusOr<LinearValue> LinearOf(const DeckFields& fields, const Instance& instance, const DeckWord& word,
                                       const Element& whole);
  // Gives `element`, which is stored next, the controls and the constant of `value`.
  void SetControls(const DeckFields& fields, const Instance& instance, const LinearValue& value, std::size_t offset,
                   Element& element);

  // The voltage sources of the deck, which may come after the expressions that need them.
  struct Sources {
    DeckNotes notes;  // they are made again with the rest of the circuit
    std::unique_ptr<DeckCircuit> of_deck;
    std::optional<KnownVoltages> known;
  };

  const DeckParts& parts_;
  const DeckOptions options_;
  DeckNotes& notes_;
  bool only_voltage_sources_ = false;
  ParameterScope* global_ = nullptr;
  Sources sources_;  // made when they are needed
  Circuit circuit_;
  double step_ = 0;
  bool turns_sources_on_ = false;
  std::map<std::string, Index> node_names_, element_names_;  // in small letters, with the names of instances
  std::map<std::string, Index> ports_;                       // their nodes outside, likewise, for messages
  std::vector<PendingControl> pending_controls_;
  std::vector<PendingCoupling> pending_couplings_;
  std::size_t expanded_ = 0;
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_CIRCUIT_H_
