// SPDX-License-Identifier: Apache-2.0
// Text files as other programs write them: every kind of file that `dlcs` reads, in every encoding.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/client/cli/program.h"

namespace dlcs::client {
namespace {

using ::testing::HasSubstr;

using Encoding = std::function<std::string(const std::string&)>;

std::string WithMark(const std::string& text) { return "\xef\xbb\xbf" + text; }

// Of ASCII.
std::string Utf16(const std::string& text, bool low_first) {
  std::string bytes = low_first ? "\xff\xfe" : "\xfe\xff";
  for (const char letter : text) bytes += low_first ? std::string{letter, '\0'} : std::string{'\0', letter};
  return bytes;
}

std::string WithLineEnds(const std::string& text, const std::string& end) {
  std::string changed;
  for (const char letter : text) changed += letter == '\n' ? end : std::string(1, letter);
  return changed;
}

const std::map<std::string, Encoding>& Encodings() {
  static const std::map<std::string, Encoding> kEncodings = {
      {"a byte order mark", WithMark},
      {"a mark and CRLF", [](const std::string& text) { return WithMark(WithLineEnds(text, "\r\n")); }},
      {"CR", [](const std::string& text) { return WithLineEnds(text, "\r"); }},
      {"UTF-16LE", [](const std::string& text) { return Utf16(text, true); }},
      {"UTF-16BE", [](const std::string& text) { return Utf16(text, false); }},
  };
  return kEncodings;
}

// One use of the program: the first file is the one that is named, or comes by standard input.
struct Use {
  std::map<std::string, std::string> files;
  std::string command;  // run in their folder
};

std::vector<Use> Uses() {
  const std::string problem =
      "{\"A\": [[-1]],\n\"B\": [[1]], \"N\": [[1]], \"M\": [[2]], \"x0\": [1], \"T\": 1, \"f\": [\"sin(t)\"]}\n";
  const std::string deck =
      "title\nV1 in 0 PWL file=points.txt\nD1 in out DX\nR1 out 0 1k\nC1 out 0 1u\n.include model.lib\n"
      ".tran 1u 1m\n.end\n";
  const std::string lcp = "{\"M\": [[2, 1], [1, 2]],\n\"q\": [-5, -6]}\n";
  const std::string dcp = "{\"M\": [[1]],\n\"q\": {\"times\": [0, 1], \"values\": [[0], [-1]]}}\n";
  const std::string mesh =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 3 \"wall\"\n2 5 \"body\"\n$EndPhysicalNames\n"
      "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n$Elements\n3\n2 1 2 3 4 4 1\n3 2 2 5 6 1 2 3\n"
      "4 2 2 5 6 1 3 4\n$EndElements\n";
  return {
      {{{"p.json", problem}}, "solve p.json --steps 4 --format csv"},
      {{{"p.json", problem}, {"times.txt", "0.25\n0.5 1\n"}}, "solve p.json --format csv --grid times.txt"},
      {{{"p.json", problem}}, "solve - --steps 4 --format csv < p.json"},
      {{{"p.json", problem}, {"members.json", "[{\"x0\":\n[2]}]\n"}},
       "ensemble p.json members.json --steps 4 --format csv"},
      {{{"p.json",
         "{\"A\": {\"matrix_market\": \"a.mtx\"}, \"B\": [[1]], \"N\": [[1]], \"M\": [[2]], \"x0\": [1], \"T\": 1}\n"},
        {"a.mtx", "%%MatrixMarket matrix coordinate real general\n% a comment\n1 1 1\n1 1 -1\n"}},
       "solve p.json --steps 4 --format csv"},
      {{{"d.cir", deck}, {"points.txt", "0 0\n1m 5\n"}, {"model.lib", "* models\n.model DX D(Vfwd=0.6 Ron=0.2)\n"}},
       "solve d.cir --at 0.0005,0.001 --format csv"},
      {{{"lcp.json", lcp}}, "lcp lcp.json"},
      {{{"lcp.json", lcp}}, "lcp - < lcp.json"},
      {{{"dcp.json", dcp}}, "dcp dcp.json --format json"},
      {{{"dcp.json", dcp}, {"v.json", "{\"times\": [0, 1],\n\"values\": [[0], [1]]}\n"}},
       "dcp dcp.json --check v.json"},
      {{{"io.json", "{\"C\": [[0.2]], \"A\": [[-1]],\n\"B\": [[0.5]], \"d\": [1], \"T\": 5, \"f\": [\"1+sin(t)\"]}\n"}},
       "model input-output io.json"},
      {{{"plate.msh", mesh}}, "model heat plate.msh --contact wall"},
  };
}

// What the program prints if the files of a use are written in an encoding.
ProgramOutcome RunIn(const Use& use, const Encoding& encoding) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / fmt::format("dlcs-encodings-{}", getpid());
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const auto& [name, text] : use.files) std::ofstream(folder / name, std::ios::binary) << encoding(text);
  ProgramOutcome outcome = RunDlcs(use.command, "cd '" + folder.string() + "' && ");
  fs::remove_all(folder);
  return outcome;
}

TEST(DlcsEncodingsTest, AllFilesMayHaveAMarkAndOtherEncodings) {
  for (const Use& use : Uses()) {
    const ProgramOutcome plain = RunIn(use, [](const std::string& text) { return text; });
    ASSERT_EQ(plain.code, 0) << use.command << "\n" << plain.err;
    EXPECT_NE(plain.out, "") << use.command;
    for (const auto& [name, encoding] : Encodings()) {
      const ProgramOutcome other = RunIn(use, encoding);
      EXPECT_EQ(other.code, 0) << use.command << " with " << name << "\n" << other.err;
      EXPECT_EQ(other.out, plain.out) << use.command << " with " << name;
    }
  }
}

// A mark within a file is no mark.
TEST(DlcsEncodingsTest, AMarkElsewhereIsRefusedWithItsPlace) {
  const Use twice = {{{"p.json", "\xef\xbb\xbf{\"A\": [[-1]]}\n"}}, "solve p.json"};
  EXPECT_EQ(RunIn(twice, WithMark).code, 2);
  const Use in_deck = {{{"d.cir", "title\n\xef\xbb\xbfR1 a 0 1\n.tran 1u 1m\n"}}, "solve d.cir"};
  const ProgramOutcome outcome = RunIn(in_deck, WithMark);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("d.cir:2:1: "));
}

TEST(DlcsEncodingsTest, NamesAnEncodingThatIsNotRead) {
  const Use use = {{{"d.cir", "title\nR1 a 0 1\n.tran 1u 1m\n"}}, "solve d.cir"};
  const ProgramOutcome without_mark = RunIn(use, [](const std::string& text) { return Utf16(text, true).substr(2); });
  EXPECT_EQ(without_mark.code, 2);
  EXPECT_THAT(without_mark.err, HasSubstr("d.cir: is text in UTF-16LE; save it as UTF-8"));
  const ProgramOutcome zero = RunIn(use, [](std::string text) { return text.replace(10, 1, 1, '\0'); });
  EXPECT_EQ(zero.code, 2);
  EXPECT_THAT(zero.err, HasSubstr("d.cir:2: holds a byte of 0"));
}

// Latin-1 as LTspice writes it is read, a deck and its library each in its own encoding; but what is no text is refused
// where it stands, and so is a micro sign that a change of the encoding has broken.
TEST(DlcsEncodingsTest, TakesLatin1ButNoMixture) {
  const std::string deck = "title\nV1 a 0 1\nR1 a b 1k\n.include c.lib\n.tran 1u 1m\n.print v(b)\n.end\n";
  const auto solve = [&](const std::string& line) {
    return RunIn({{{"d.cir", deck}, {"c.lib", line}}, "solve d.cir --at 0.0005 --format csv"},
                 [](const std::string& text) { return text; });
  };
  const ProgramOutcome plain = solve("* f\xc3\xbcr\nC1 b 0 1u\n"), latin = solve("* f\xfcr\nC1 b 0 1\xb5\n");
  ASSERT_EQ(plain.code, 0) << plain.err;
  EXPECT_EQ(latin.out, plain.out);
  const ProgramOutcome broken = solve("* f\xc3\xbcr\nC1 b 0 1\u00c2\u00b5\n");
  EXPECT_EQ(broken.code, 2);
  EXPECT_THAT(broken.err, HasSubstr("c.lib:2:8: \"1\u00c2\u00b5\" is not a number; this was a \u00b5"));
  const ProgramOutcome mixed = solve("* f\xc3\xbcr\nC1 b 0 1\xff\n");
  EXPECT_EQ(mixed.code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("c.lib:2: the byte 0xff is not UTF-8"));
  const ProgramOutcome control = solve("C1 b 0 1\x01\n");
  EXPECT_EQ(control.code, 2);
  EXPECT_THAT(control.err, HasSubstr("c.lib:1:8: \"1\x01\", with the control character 0x01, is not a number"));
}

}  // namespace
}  // namespace dlcs::client
