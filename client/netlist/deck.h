// SPDX-License-Identifier: Apache-2.0
// SPICE decks as circuits.

#ifndef DLCS_CLIENT_NETLIST_DECK_H_
#define DLCS_CLIENT_NETLIST_DECK_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/deck_options.h"
#include "client/netlist/deck_quantities.h"
#include "client/netlist/deck_steps.h"
#include "client/netlist/deck_tolerances.h"
#include "client/netlist/measurements.h"
#include "core/circuits/circuit.h"

namespace dlcs::client {

struct Deck {
  std::string title;
  Circuit circuit;
  double output_step = 0;                     // TSTEP of .tran; 0 if it is none
  std::vector<DeckQuantity> outputs;          // of .print, .plot, .probe and .save, with one factor; none for all
  std::vector<DeckMeasurement> measurements;  // of .meas
  std::vector<ParameterStep> steps;           // of .step
  DeckTolerances tolerances;                  // of .options
  std::vector<std::string> notes;             // what was ignored or assumed
};

// Reads the deck `text`. Elements R L C K V I E F G H D S W X (B, E and G with linear expressions), with .param .func
// .model .subckt .include .lib .global .ic .step .tran .print .meas .options; client/README.md describes the language.
// `source` is the deck's name in messages, `folder` its folder for includes, empty for none.
//
// Errors: InvalidArgument "file:line:column: what", of the first thing that is wrong or not supported. Nothing is left
// out without a note.
absl::StatusOr<Deck> ReadDeck(const std::string& text, const std::string& source, const std::string& folder,
                              const DeckOptions& options);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_H_
