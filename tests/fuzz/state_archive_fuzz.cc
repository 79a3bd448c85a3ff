// SPDX-License-Identifier: Apache-2.0
// Stored states as bytes, with values of every kind in them: as they are, and with a correct checksum, so that the code
// after its check is tested too.
#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/discretization/state_archive.h"
#include "tests/fuzz/fuzz_target.h"

namespace dlcs::fuzz {
namespace {

struct Part {
  double number = 0;
  std::string name;
  std::optional<Vector> vector;
  friend void CarryFields(StateArchive& archive, Part& part) { archive(part.number, part.name, part.vector); }
};

struct Everything {
  bool flag = false;
  Index index = 0;
  Matrix matrix;
  std::vector<Part> parts;
  std::vector<std::vector<Index>> lists;
  std::optional<std::string> text;
  friend void CarryFields(StateArchive& archive, Everything& all) {
    archive(all.flag, all.index, all.matrix, all.parts, all.lists, all.text);
  }
};

// A number is stored as its eight bytes, including NaN.
std::string WithChecksum(const std::string& bytes) {
  StateArchive archive;
  for (std::size_t k = 0; k < bytes.size(); k += sizeof(double)) {
    double number = 0;
    std::memcpy(&number, bytes.data() + k, std::min(sizeof number, bytes.size() - k));
    archive(number);
  }
  return archive.Take();
}

std::string Written(Everything& all) {
  StateArchive archive;
  archive(all);
  return archive.Take();
}

void Read(const std::string& bytes) {
  StateArchive archive(bytes);
  Everything all;
  archive(all);
  if (!archive.ok()) return;
  const std::string written = Written(all);
  StateArchive again(written);
  Everything same;
  again(same);
  Require(again.at_end() && Written(same) == written, "what is read is written and read again");
}

}  // namespace

void TryStateArchive(const std::string& input) {
  Read(input);
  Read(WithChecksum(input));
}

}  // namespace dlcs::fuzz
