// SPDX-License-Identifier: Apache-2.0
// SPICE decks, as `dlcs netlist` reads them: the problem file of an accepted deck can be read again, with its outputs
// and measurements.

#include "client/files/problem_file.h"
#include "client/netlist/netlist.h"
#include "tests/fuzz/fuzz_target.h"

namespace dlcs::fuzz {

void TryDeck(const std::string& input) {
  if (input.size() > 10'000) return;  // a problem grows with the square of the deck
  const auto netlist = client::ReadNetlist(input, "input", /*folder=*/"", {});
  if (!netlist.ok()) return;
  const auto file = client::ParseProblem(client::NetlistJson(*netlist).dump(), "made");
  Require(file.ok(), "a deck makes a problem file");
  Require(file->problem.outputs().names_size() == netlist->problem.outputs().names_size(), "outputs are kept");
  Require(file->problem.measurements_size() == netlist->problem.measurements_size(), "measurements are kept");
}

}  // namespace dlcs::fuzz
