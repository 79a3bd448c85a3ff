// SPDX-License-Identifier: Apache-2.0
// The lines of a SPICE deck and of the files that it includes.

#ifndef DLCS_CLIENT_NETLIST_DECK_LINES_H_
#define DLCS_CLIENT_NETLIST_DECK_LINES_H_

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace dlcs::client {

// A line with its continuation lines, without comments.
struct DeckLine {
  struct Segment {
    std::size_t offset = 0;  // in `text`
    std::size_t line = 0, column = 0;
  };
  std::string file;  // as messages name it
  std::string text;
  std::vector<Segment> segments;  // where the parts of `text` come from, at least one

  // The last one that begins at or before `offset`.
  Segment SegmentOf(std::size_t offset) const;
  // "buck.cir:7:12" for the byte at `offset` of `text`; "buck.cir:7" for the line.
  std::string Place(std::size_t offset) const;
  std::string Place() const;
};

struct DeckText {
  std::string title;
  std::vector<DeckLine> lines;
  std::vector<DeckLine> runs;      // "tran ..." of .control blocks, not in `lines`; at most two
  std::vector<std::string> notes;  // what was left out
};

// Splits a deck, a text in UTF-8 or else in Latin-1. The first line is the title. A line that begins with + continues
// the one before; * begins a comment line; ; begins a comment anywhere, and so do $ and // after a blank. Ends at .end.
// Between .control and .endc nothing but tran is read; commands there that change the circuit before it is run are
// refused.
//
// `.include FILE` and `.lib FILE [SECTION]` insert the lines of a file below `folder`, the deck's; `folder` is empty
// where there is none (standard input). PWL file=NAME holds the numbers of such a file afterwards. Errors:
// InvalidArgument with the place: an include that is absolute, leads out of the folder, does not exist, includes
// itself, or is nested deeper than 16; more than 1,000,000 lines.
absl::StatusOr<DeckText> SplitDeck(const std::string& text, const std::string& source, const std::string& folder);

// InvalidArgument "place: what".
absl::Status DeckError(const std::string& place, const std::string& what);

// In small letters of ASCII.
std::string Lower(std::string_view text);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_DECK_LINES_H_
