// SPDX-License-Identifier: Apache-2.0
// SPICE decks, as `dlcs netlist` reads them: a deck that is accepted makes a problem file, with outputs that can be
// read again.

#include "client/files/problem_file.h"
#include "client/netlist/circuit_outputs.h"
#include "client/netlist/netlist.h"
#include "tests/fuzz/fuzz_target.h"

namespace dlcs::fuzz {

void TryDeck(const std::string& input) {
  if (input.size() > 10'000) return;  // a problem grows with the square of the deck
  const auto netlist = client::ReadNetlist(input, "input", /*folder=*/"", {});
  if (!netlist.ok()) return;
  const auto file = client::ParseProblem(client::NetlistJson(*netlist).dump(), "made");
  Require(file.ok(), "a deck makes a problem file");
  Require(client::OutputsFromJson(file->outputs, "made").ok(), "the outputs of a deck can be read");
}

}  // namespace dlcs::fuzz
