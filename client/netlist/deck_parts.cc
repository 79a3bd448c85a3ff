// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "proto/shared/nearest_name.h"

namespace dlcs::client {
namespace {

class DeckSorter {
 public:
  absl::StatusOr<DeckParts> Run(const DeckText& text) {
    if (absl::Status status = Sort(text); !status.ok()) return status;
    if (std::string note = NoteOnTitle(text.title); !note.empty()) parts_.notes.push_back(std::move(note));
    if (parts_.tran == nullptr && text.runs.size() > 1) {
      return DeckError(text.runs[1].Place(),
                       "there is no .tran, and the .control block has several; write the one that is meant as .tran "
                       "outside of it");
    }
    if (parts_.tran == nullptr && text.runs.size() == 1) {
      parts_.tran = &text.runs.front();
      parts_.notes.push_back(
          fmt::format("{}: there is no .tran, and that of the .control block is taken", parts_.tran->Place()));
    }
    return std::move(parts_);
  }

 private:
  absl::Status Sort(const DeckText& text) {
    std::vector<DeckBody*> open = {&parts_.top};
    std::vector<const DeckSubcircuit*> names;
    for (const DeckLine& line : text.lines) {
      const std::vector<DeckWord> words = WordsOf(line);
      const std::string first = words.empty() ? "" : Lower(words[0].text);
      if (first.empty()) continue;
      if (const auto open_at = UnclosedIn(line.text)) {
        return DeckError(line.Place(*open_at), fmt::format("this {} is not closed", line.text[*open_at]));
      }
      if (first == ")" && words.size() == 1) {
        parts_.notes.push_back(
            fmt::format("{}: a ) alone is ignored; a line that goes on begins with +", line.Place()));
      } else if (first[0] != '.') {
        open.back()->elements.push_back(&line);
      } else if (first == ".subckt") {
        auto subcircuit = ReadSubcircuit(line, words);
        if (!subcircuit.ok()) return subcircuit.status();
        const std::string name = Lower(subcircuit->name);
        const auto [place, is_new] = open.back()->subcircuits.emplace(name, *std::move(subcircuit));
        if (!is_new) {
          return DeckError(line.Place(words[1].offset), fmt::format(".subckt {} is defined twice, first at {}",
                                                                    words[1].text, place->second.line->Place()));
        }
        if (open.size() > kMaxSubcircuitDepth) return DeckError(line.Place(), "definitions are nested too deep");
        names.push_back(&place->second);
        open.push_back(place->second.body.get());
      } else if (first == ".ends") {
        if (open.size() == 1) return DeckError(line.Place(), ".ends without .subckt");
        if (words.size() > 1 && Lower(words[1].text) != Lower(names.back()->name)) {
          return DeckError(line.Place(words[1].offset),
                           fmt::format(".ends {} closes .subckt {}", words[1].text, names.back()->name));
        }
        open.pop_back();
        names.pop_back();
      } else if (first == ".model") {
        if (absl::Status status = ReadModel(line, words, *open.back()); !status.ok()) return status;
      } else if (first == ".param" || first == ".params" || first == ".func") {
        open.back()->parameters.push_back(&line);
      } else if (first == ".ic") {
        open.back()->initial.push_back(&line);
      } else if (absl::Status status = SortCommand(line, words, first, open.size() > 1); !status.ok()) {
        return status;
      }
    }
    if (open.size() > 1) {
      return DeckError(names.back()->line->Place(), fmt::format(".subckt {} has no .ends", names.back()->name));
    }
    return absl::OkStatus();
  }

  absl::Status SortCommand(const DeckLine& line, const std::vector<DeckWord>& words, const std::string& first,
                           bool inside) {
    static const std::set<std::string> kOutputs = {".print", ".plot", ".probe", ".save"};
    static const std::set<std::string> kIgnored = {".temp",  ".width", ".title", ".op",      ".dc",       ".ac",
                                                   ".noise", ".four",  ".tf",    ".nodeset", ".backanno", ".pz",
                                                   ".sens",  ".disto", ".net",   ".wave",    ".csparam"};
    static const std::set<std::string> kOptions = {".option", ".options", ".opt"};
    static const std::vector<std::string> kKnown = {".tran",  ".param",  ".func", ".model",   ".subckt",  ".ends",
                                                    ".ic",    ".global", ".step", ".include", ".lib",     ".print",
                                                    ".probe", ".save",   ".meas", ".options", ".nodeset", ".end"};
    if (first == ".tran") {
      if (inside) return DeckError(line.Place(), ".tran inside of .subckt; is an .ends missing?");
      if (parts_.tran != nullptr) {
        return DeckError(line.Place(), fmt::format("a second .tran; the first is at {}", parts_.tran->Place()));
      }
      parts_.tran = &line;
    } else if (first == ".step") {
      if (inside) return DeckError(line.Place(), ".step inside of .subckt is not supported");
      parts_.steps.push_back(&line);
    } else if (first == ".global") {
      for (std::size_t k = 1; k < words.size(); ++k) parts_.globals.insert(Lower(words[k].text));
    } else if (kOutputs.contains(first)) {
      parts_.outputs.push_back(&line);
    } else if (first == ".meas" || first == ".measure") {
      if (inside) return DeckError(line.Place(), fmt::format("{} inside of .subckt is not supported", first));
      parts_.measurements.push_back(&line);
    } else if (kOptions.contains(first) || kIgnored.contains(first)) {
      const bool is_temperature = std::any_of(words.begin(), words.end(), [](const DeckWord& word) {
        const std::string lower = Lower(word.text);
        return lower == ".temp" || lower == "temp" || lower == "tnom";
      });
      parts_.sets_temperature = parts_.sets_temperature || is_temperature;
      if (kOptions.contains(first)) {
        parts_.options.push_back(&line);
      } else {
        parts_.notes.push_back(fmt::format("{}: {} is ignored", line.Place(), first));
      }
    } else {
      return DeckError(line.Place(words[0].offset),
                       fmt::format("{} is not supported{}", first, DidYouMean(NearestName(first, kKnown))));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<DeckSubcircuit> ReadSubcircuit(const DeckLine& line, const std::vector<DeckWord>& words) {
    if (words.size() < 2) return DeckError(line.Place(), ".subckt needs a name");
    DeckSubcircuit made;
    made.name = words[1].text;
    made.line = &line;
    made.body = std::make_shared<DeckBody>();
    std::size_t k = 2;
    for (; k < words.size(); ++k) {
      const std::string word = Lower(words[k].text);
      if (word == "(" || word == ")") continue;
      if (word == "params:" || word == "params") {
        ++k;
        break;
      }
      if (k + 1 < words.size() && words[k + 1].text == "=") break;
      if (std::find(made.ports.begin(), made.ports.end(), word) != made.ports.end()) {
        return DeckError(line.Place(words[k].offset), fmt::format("node {} occurs twice in .subckt", words[k].text));
      }
      made.ports.push_back(word);
    }
    for (; k < words.size(); k += 3) {
      if (k + 2 >= words.size() || words[k + 1].text != "=") {
        return DeckError(line.Place(words[k].offset), "expected name=value");
      }
      made.defaults.push_back(words[k]);
      made.defaults.push_back(words[k + 2]);
    }
    return made;
  }

  absl::Status ReadModel(const DeckLine& line, const std::vector<DeckWord>& words, DeckBody& body) {
    if (words.size() < 3) return DeckError(line.Place(), ".model needs a name and a type, as in .model DX D(IS=1e-14)");
    DeckModel model;
    model.type = Lower(words[2].text);
    model.line = &line;
    model.offset = words[2].offset;
    std::vector<DeckWord> rest;
    for (std::size_t k = 3; k < words.size(); ++k) {
      if (words[k].text != "(" && words[k].text != ")") rest.push_back(words[k]);
    }
    for (std::size_t k = 0; k < rest.size();) {
      const std::string name = Lower(rest[k].text);
      if (k + 2 < rest.size() && rest[k + 1].text == "=") {
        if (!model.values.emplace(name, rest[k + 2]).second) {
          return DeckError(line.Place(rest[k].offset),
                           fmt::format(".model {}: {} is given twice", words[1].text, rest[k].text));
        }
        k += 3;
      } else if (name == "nchan" || name == "pchan") {
        model.values.emplace(name, DeckWord{"1", rest[k].offset, false});
        ++k;
      } else {
        return DeckError(line.Place(rest[k].offset),
                         fmt::format(".model {}: \"{}\" is not followed by =; parameters are "
                                     "written NAME=VALUE",
                                     words[1].text, rest[k].text));
      }
    }
    const auto [place, is_new] = body.models.emplace(Lower(words[1].text), std::move(model));
    if (!is_new) {
      return DeckError(line.Place(words[1].offset), fmt::format(".model {} is defined twice, first at {}",
                                                                words[1].text, place->second.line->Place()));
    }
    return absl::OkStatus();
  }

  DeckParts parts_;
};

}  // namespace

std::string NoteOnTitle(const std::string& title) {
  if (Lower(title).starts_with(".title")) return "";
  const auto words = std::count(title.begin(), title.end(), ' ') + 1;
  const bool is_element = words >= 4 && words <= 6 && std::isalpha(static_cast<unsigned char>(title[0])) != 0 &&
                          title.find_first_of("0123456789") < title.find(' ');
  if (!is_element && (title.size() < 2 || title[0] != '.')) return "";
  return fmt::format("line 1 of a deck is its title, and is not read: \"{}\"", title);
}

absl::StatusOr<DeckParts> SortDeck(const DeckText& text) { return DeckSorter().Run(text); }

}  // namespace dlcs::client
