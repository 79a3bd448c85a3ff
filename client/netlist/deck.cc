// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/deck.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "client/netlist/deck_lines.h"
#include "client/netlist/deck_words.h"
#include "client/netlist/spice_expression.h"
#include "proto/shared/nearest_name.h"

namespace dlcs::client {
namespace {

// Dense matrices of the formulation grow with the square.
constexpr std::size_t kMaxElements = 2000;
constexpr int kMaxSubcircuitDepth = 32;
constexpr double kThermalVoltage = 1.380649e-23 * 300.15 / 1.602176634e-19;  // at 27 degrees, as SPICE has it

std::size_t AsSize(Index index) { return static_cast<std::size_t>(index); }

// name=value pairs at the end of a line, names in small letters.
using NamedWords = std::map<std::string, DeckWord>;

struct Model {
  std::string type;  // in small letters: d, sw, csw
  NamedWords values;
  const DeckLine* line = nullptr;
  std::size_t offset = 0;
};

struct Subcircuit {
  std::string name;
  std::vector<std::string> ports;  // in small letters
  std::vector<DeckWord> defaults;  // name = value
  const DeckLine* line = nullptr;
  struct Body;
  std::shared_ptr<Body> body;
};

// What is defined between .subckt and .ends, or in the deck outside of all.
struct Subcircuit::Body {
  std::vector<const DeckLine*> elements;
  std::vector<const DeckLine*> parameters;  // .param and .func
  std::map<std::string, Model> models;
  std::map<std::string, Subcircuit> subcircuits;
};

// A part of the circuit: the deck itself, or one instance of a subcircuit.
struct Instance {
  std::string prefix;  // "X1." in front of names
  const Subcircuit::Body* body = nullptr;
  ParameterScope* scope = nullptr;
  std::map<std::string, Index> nodes;  // of its ports, in small letters
  const Instance* around = nullptr;    // where it is defined: models and subcircuits are looked up there too
  int depth = 0;
};

class DeckReader {
 public:
  DeckReader(DeckText text, const DeckOptions& options) : text_(std::move(text)), options_(options) {}

  absl::StatusOr<Deck> Read() {
    deck_.title = text_.title;
    deck_.notes = text_.notes;
    deck_.circuit.nodes = {"0"};
    if (absl::Status status = Sort(); !status.ok()) return status;
    NoteTitle();
    ParameterScope global;
    Instance top{.prefix = "", .body = &top_, .scope = &global, .nodes = {}, .around = nullptr, .depth = 0};
    if (absl::Status status = DefineParameters(top_, global); !status.ok()) return status;
    if (absl::Status status = ReadAnalyses(global); !status.ok()) return status;
    if (absl::Status status = Expand(top); !status.ok()) return status;
    if (deck_.circuit.elements.empty()) return absl::InvalidArgumentError("the deck has no element");
    if (absl::Status status = ResolveNames(); !status.ok()) return status;
    if (absl::Status status = ReadInitialConditions(global); !status.ok()) return status;
    if (absl::Status status = ReadOutputs(); !status.ok()) return status;
    return std::move(deck_);
  }

 private:
  void Note(std::string note) {
    if (std::find(deck_.notes.begin(), deck_.notes.end(), note) == deck_.notes.end()) {
      deck_.notes.push_back(std::move(note));
    }
  }

  // The first line is the title, even if it looks like an element.
  void NoteTitle() {
    const std::string& title = text_.title;
    const auto words = std::count(title.begin(), title.end(), ' ') + 1;
    const bool is_element = words >= 4 && words <= 6 && std::isalpha(static_cast<unsigned char>(title[0])) != 0 &&
                            title.find_first_of("0123456789") < title.find(' ');
    if (is_element || (title.size() > 1 && title[0] == '.')) {
      Note(fmt::format("line 1 of a deck is its title, and is not read: \"{}\"", title));
    }
  }

  // --- Which line is what ---

  absl::Status Sort() {
    std::vector<Subcircuit::Body*> open = {&top_};
    std::vector<const Subcircuit*> names;
    for (const DeckLine& line : text_.lines) {
      const std::vector<DeckWord> words = WordsOf(line);
      const std::string first = words.empty() ? "" : Lower(words[0].text);
      if (first.empty()) continue;
      if (first[0] != '.') {
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
    static const std::set<std::string> kIgnored = {".option", ".options", ".opt",     ".temp",     ".width", ".title",
                                                   ".op",     ".dc",      ".ac",      ".noise",    ".four",  ".tf",
                                                   ".meas",   ".measure", ".nodeset", ".backanno", ".pz",    ".sens",
                                                   ".disto",  ".net",     ".wave"};
    if (first == ".tran") {
      if (inside) return DeckError(line.Place(), ".tran inside of .subckt; is an .ends missing?");
      if (tran_ != nullptr) {
        return DeckError(line.Place(), fmt::format("a second .tran; the first is at {}", tran_->Place()));
      }
      tran_ = &line;
    } else if (first == ".ic") {
      if (inside) return DeckError(line.Place(), ".ic inside of .subckt is not supported");
      initial_.push_back(&line);
    } else if (first == ".global") {
      for (std::size_t k = 1; k < words.size(); ++k) globals_.insert(Lower(words[k].text));
    } else if (kOutputs.contains(first)) {
      output_lines_.push_back(&line);
    } else if (kIgnored.contains(first)) {
      Note(fmt::format("{}: {} is ignored", line.Place(), first));
    } else {
      return DeckError(line.Place(words[0].offset), fmt::format("{} is not supported", first));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Subcircuit> ReadSubcircuit(const DeckLine& line, const std::vector<DeckWord>& words) {
    if (words.size() < 2) return DeckError(line.Place(), ".subckt needs a name");
    Subcircuit made;
    made.name = words[1].text;
    made.line = &line;
    made.body = std::make_shared<Subcircuit::Body>();
    std::size_t k = 2;
    for (; k < words.size(); ++k) {
      const std::string word = Lower(words[k].text);
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

  absl::Status ReadModel(const DeckLine& line, const std::vector<DeckWord>& words, Subcircuit::Body& body) {
    if (words.size() < 3) return DeckError(line.Place(), ".model needs a name and a type, as in .model DX D(IS=1e-14)");
    Model model;
    model.type = Lower(words[2].text);
    model.line = &line;
    model.offset = words[2].offset;
    std::vector<DeckWord> rest;
    for (std::size_t k = 3; k < words.size(); ++k) {
      if (words[k].text != "(" && words[k].text != ")") rest.push_back(words[k]);
    }
    for (std::size_t k = 0; k < rest.size();) {
      if (k + 2 < rest.size() + 0 && rest[k + 1].text == "=") {
        model.values.insert_or_assign(Lower(rest[k].text), rest[k + 2]);
        k += 3;
      } else {
        // A flag.
        model.values.insert_or_assign(Lower(rest[k].text), DeckWord{"1", rest[k].offset, false});
        ++k;
      }
    }
    const auto [place, is_new] = body.models.emplace(Lower(words[1].text), std::move(model));
    if (!is_new) {
      return DeckError(line.Place(words[1].offset), fmt::format(".model {} is defined twice, first at {}",
                                                                words[1].text, place->second.line->Place()));
    }
    return absl::OkStatus();
  }

  // --- Parameters ---

  absl::Status DefineParameters(const Subcircuit::Body& body, ParameterScope& scope) {
    for (const DeckLine* line : body.parameters) {
      const absl::Status status =
          Lower(line->text).starts_with(".func") ? DefineFunction(*line, scope) : DefineParameter(*line, scope);
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  absl::Status DefineParameter(const DeckLine& line, ParameterScope& scope) {
    const auto definitions = DefinitionsOf(line, line.text.find_first_of(" \t"));
    if (!definitions.ok()) return definitions.status();
    for (const auto& [name, expression, offset] : *definitions) {
      if (scope.Define(Lower(name), expression)) continue;
      // Given by the instance, or twice here: the last of the deck counts in SPICE, but a slip is likelier.
      if (given_.contains({&scope, Lower(name)})) continue;
      return DeckError(line.Place(offset), fmt::format("parameter {} is defined twice", name));
    }
    return absl::OkStatus();
  }

  absl::Status DefineFunction(const DeckLine& line, ParameterScope& scope) {
    const std::size_t open = line.text.find('('), close = line.text.find(')');
    if (open == std::string::npos || close == std::string::npos || close < open) {
      return DeckError(line.Place(), ".func needs a name with arguments, as in .func f(x) {2*x}");
    }
    const std::string name = Lower(Trimmed(line.text.substr(5, open - 5)));
    std::vector<std::string> arguments;
    std::string argument;
    for (std::size_t k = open + 1; k <= close; ++k) {
      if (line.text[k] == ',' || k == close) {
        if (argument = Lower(Trimmed(argument)); !argument.empty()) arguments.push_back(argument);
        argument.clear();
      } else {
        argument += line.text[k];
      }
    }
    std::string body = Trimmed(line.text.substr(close + 1));
    if (!body.empty() && body[0] == '=') body = Trimmed(body.substr(1));
    body = WithoutBraces(body);
    if (name.empty() || body.empty()) return DeckError(line.Place(), ".func needs a name and a body");
    if (scope.DefineFunction(name, arguments, body)) return absl::OkStatus();
    return DeckError(line.Place(), fmt::format("function {} is defined twice", name));
  }

  // A word that is a number or an expression in braces.
  absl::StatusOr<double> ValueOf(const DeckLine& line, const DeckWord& word, ParameterScope& scope) {
    if (word.is_expression) {
      const auto value = scope.Evaluate(word.text);
      if (!value.ok()) return DeckError(line.Place(word.offset), std::string(value.status().message()));
      return *value;
    }
    if (const auto number = ReadSpiceNumber(word.text)) {
      NoteUnit(line, word, *number);
      return *number;
    }
    if (scope.Evaluate(word.text).ok()) {
      return DeckError(line.Place(word.offset),
                       fmt::format("\"{0}\" is no number; a parameter is written in braces: {{{0}}}", word.text));
    }
    return DeckError(line.Place(word.offset), fmt::format("\"{}\" is no number", word.text));
  }

  // 1F is a femto-something.
  void NoteUnit(const DeckLine& line, const DeckWord& word, double number) {
    const std::string lower = Lower(word.text);
    const std::size_t letter = lower.find_first_not_of("0123456789.+-e");
    if (letter != std::string::npos && lower.substr(letter).starts_with("f") && number != 0) {
      const std::string rest = lower.substr(letter);
      if (rest == "f" || rest == "farad") {
        Note(fmt::format("{}: {} is {:g}: f is femto", line.Place(word.offset), word.text, number));
      }
    }
  }

  // --- Analyses ---

  absl::Status ReadAnalyses(ParameterScope& scope) {
    if (tran_ == nullptr) return absl::InvalidArgumentError("the deck has no .tran, which says how long to solve");
    std::vector<double> times;
    for (const DeckWord& word : WordsOf(*tran_)) {
      const std::string lower = Lower(word.text);
      if (lower == ".tran") continue;
      if (lower == "uic") {
        deck_.circuit.uses_initial_conditions = true;
        continue;
      }
      const auto value = ValueOf(*tran_, word, scope);
      if (!value.ok()) return value.status();
      times.push_back(*value);
    }
    if (times.empty() || times.size() > 4) {
      return DeckError(tran_->Place(), ".tran is written .tran TSTEP TSTOP [TSTART [TMAX]] [UIC]");
    }
    deck_.output_step = times.size() > 1 ? std::max(0.0, times[0]) : 0;
    deck_.circuit.horizon = times.size() > 1 ? times[1] : times[0];
    if (times.size() > 2 && times[2] > 0) {
      Note(fmt::format("{}: TSTART = {:g} of .tran is ignored: results begin at 0; --at takes the times to show",
                       tran_->Place(), times[2]));
    }
    if (!(deck_.circuit.horizon > 0)) {
      return DeckError(tran_->Place(), fmt::format("TSTOP is {:g}; must be above 0", deck_.circuit.horizon));
    }
    return absl::OkStatus();
  }

  // V(node)=volts and I(inductor)=amperes.
  absl::Status ReadInitialConditions(ParameterScope& scope) {
    for (const DeckLine* line : initial_) {
      const std::vector<DeckWord> words = WordsOf(*line);
      for (std::size_t k = 1; k < words.size(); k += 6) {
        const bool fits =
            k + 5 < words.size() && words[k + 1].text == "(" && words[k + 3].text == ")" && words[k + 4].text == "=";
        const std::string kind = Lower(words[k].text);
        if (!fits || (kind != "v" && kind != "i")) {
          return DeckError(line->Place(words[k].offset), ".ic is written .ic V(node)=value");
        }
        const auto value = ValueOf(*line, words[k + 5], scope);
        if (!value.ok()) return value.status();
        const std::string name = Lower(words[k + 2].text);
        if (kind == "i") {
          const Index element = ElementNamed(name);
          if (element < 0 || circuit().elements[AsSize(element)].kind != ElementKind::kInductor) {
            return DeckError(line->Place(words[k + 2].offset), fmt::format("\"{}\" is no inductor", words[k + 2].text));
          }
          if (!circuit().uses_initial_conditions) {
            return DeckError(line->Place(words[k].offset), ".ic of a current is supported with UIC only");
          }
          circuit().elements[AsSize(element)].initial = *value;
          continue;
        }
        const auto node = node_names_.find(name);
        if (node == node_names_.end()) {
          return DeckError(line->Place(words[k + 2].offset), fmt::format("\"{}\" is no node", words[k + 2].text));
        }
        if (node->second == 0) return DeckError(line->Place(words[k + 2].offset), "ground is at 0 V");
        circuit().node_voltages.push_back({node->second, *value});
      }
    }
    if (circuit().uses_initial_conditions) return absl::OkStatus();
    for (const Element& element : circuit().elements) {
      if (element.initial) {
        Note(fmt::format("{}: IC of {} is ignored, as in SPICE: .tran has no UIC, and starts at the operating point",
                         element.place, element.name));
      }
    }
    return absl::OkStatus();
  }

  absl::Status ReadOutputs() {
    static const std::set<std::string> kOther = {"tran", "all", "ac", "dc", "alli", "allv"};
    for (const DeckLine* line : output_lines_) {
      const std::vector<DeckWord> words = WordsOf(*line);
      for (std::size_t k = 1; k < words.size(); ++k) {
        const std::string kind = Lower(words[k].text);
        if (k + 1 >= words.size() || words[k + 1].text != "(") {
          if (!kOther.contains(kind)) {
            Note(fmt::format("{}: output {} is ignored", line->Place(words[k].offset), words[k].text));
          }
          continue;
        }
        std::size_t close = k + 2;
        std::vector<std::string> names;
        while (close < words.size() && words[close].text != ")") names.push_back(Lower(words[close++].text));
        const bool is_known = (kind == "v" && (names.size() == 1 || names.size() == 2) &&
                               std::all_of(names.begin(), names.end(),
                                           [this](const std::string& name) { return node_names_.contains(name); })) ||
                              (kind == "i" && names.size() == 1 && ElementNamed(names[0]) >= 0);
        if (is_known) {
          deck_.outputs.push_back(fmt::format("{}({})", kind, fmt::join(names, ",")));
        } else {
          Note(fmt::format("{}: output {}({}) is ignored: the deck has no such {}", line->Place(words[k].offset), kind,
                           fmt::join(names, ","), kind == "i" ? "element" : "node"));
        }
        k = close;
      }
    }
    return absl::OkStatus();
  }

  // --- Elements ---

  Circuit& circuit() { return deck_.circuit; }

  Index ElementNamed(const std::string& lower) const {
    const auto found = element_names_.find(lower);
    return found == element_names_.end() ? -1 : found->second;
  }

  Index NodeOf(const Instance& instance, const std::string& name) {
    const std::string lower = Lower(name);
    if (lower == "0" || lower == "gnd") {
      node_names_.emplace(lower, 0);
      return 0;
    }
    if (const auto port = instance.nodes.find(lower); port != instance.nodes.end()) return port->second;
    const bool is_global = globals_.contains(lower);
    const std::string full = is_global ? lower : Lower(instance.prefix) + lower;
    const auto [found, is_new] = node_names_.emplace(full, static_cast<Index>(circuit().nodes.size()));
    if (is_new) circuit().nodes.push_back(is_global ? name : instance.prefix + name);
    return found->second;
  }

  absl::Status Expand(const Instance& instance) {
    for (const DeckLine* line : instance.body->elements) {
      if (absl::Status status = AddElement(*line, instance); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  // The words of an element: those by position, and name=value.
  struct Fields {
    const DeckLine* line;
    std::vector<DeckWord> words;
    NamedWords named;

    std::string Place(std::size_t k) const { return line->Place(words[std::min(k, words.size() - 1)].offset); }
  };

  // The expression of a B element needs no braces: it ends with the line.
  static void JoinExpression(const DeckLine& line, std::vector<DeckWord>& words) {
    if (words.size() < 6 || words[4].text != "=" || words[5].is_expression) return;
    words[5] = {Trimmed(std::string_view(line.text).substr(words[5].offset)), words[5].offset, true};
    words.resize(6);
  }

  absl::Status AddElement(const DeckLine& line, const Instance& instance) {
    Fields fields{&line, {}, {}};
    std::vector<DeckWord> words = WordsOf(line);
    if (Lower(line.text)[0] == 'b') JoinExpression(line, words);
    for (std::size_t k = 0; k < words.size(); ++k) {
      if (k + 1 < words.size() && words[k + 1].text == "=" && !words[k + 1].is_expression) {
        if (k + 2 >= words.size()) return DeckError(line.Place(words[k].offset), "a value is missing after =");
        if (!fields.named.emplace(Lower(words[k].text), words[k + 2]).second) {
          return DeckError(line.Place(words[k].offset), fmt::format("{} is given twice", words[k].text));
        }
        k += 2;
      } else {
        fields.words.push_back(words[k]);
      }
    }
    if (fields.words.empty()) return DeckError(line.Place(), "an element needs a name");
    if (circuit().elements.size() >= kMaxElements) {
      return DeckError(line.Place(), fmt::format("more than {} elements after expansion", kMaxElements));
    }
    Element element;
    element.name = instance.prefix + words[0].text;
    element.place = line.Place();
    const char kind = Lower(words[0].text)[0];
    switch (kind) {
      case 'r':
      case 'c':
      case 'l':
        return AddPassive(fields, instance, std::move(element), kind);
      case 'k':
        return AddCoupling(fields, instance);
      case 'v':
      case 'i':
        return AddSource(fields, instance, std::move(element), kind);
      case 'e':
      case 'f':
      case 'g':
      case 'h':
        return AddControlled(fields, instance, std::move(element), kind);
      case 'b':
        return AddBehavioral(fields, instance, element);
      case 'd':
        return AddDiode(fields, instance, std::move(element));
      case 's':
      case 'w':
        return AddSwitch(fields, instance, std::move(element), kind);
      case 'x':
        return AddInstance(fields, instance);
      default:
        return DeckError(line.Place(words[0].offset), NotSupported(words[0].text, kind));
    }
  }

  static std::string NotSupported(const std::string& name, char kind) {
    switch (kind) {
      case 'm':
      case 'q':
      case 'j':
      case 'z':
        return fmt::format(
            "{}: transistors are not supported; a switch S with a diode D replaces one that is turned "
            "on and off",
            name);
      case 't':
      case 'o':
      case 'u':
        return fmt::format("{}: transmission lines are not supported", name);
      case 'a':
        return fmt::format("{}: code models are not supported", name);
      default:
        return fmt::format("{}: an element that begins with {} is not known", name, name[0]);
    }
  }

  absl::Status NeedWords(const Fields& fields, std::size_t count, const char* form) {
    if (fields.words.size() >= count) return absl::OkStatus();
    return DeckError(fields.line->Place(),
                     fmt::format("{} has too few fields; it is written {}", fields.words[0].text, form));
  }

  absl::Status RefuseRest(const Fields& fields, std::size_t used, const std::set<std::string>& names) {
    if (fields.words.size() > used) {
      return DeckError(fields.Place(used),
                       fmt::format("{}: \"{}\" is not supported here", fields.words[0].text, fields.words[used].text));
    }
    for (const auto& [name, word] : fields.named) {
      if (names.contains(name)) continue;
      return DeckError(fields.line->Place(word.offset),
                       fmt::format("{}: {}={} is not supported", fields.words[0].text, name, word.text));
    }
    return absl::OkStatus();
  }

  absl::Status Store(Element element, const Fields& fields) {
    const std::string lower = Lower(element.name);
    const auto [other, is_new] = element_names_.emplace(lower, static_cast<Index>(circuit().elements.size()));
    if (!is_new) {
      return DeckError(fields.Place(0), fmt::format("{} is there twice, first at {}", element.name,
                                                    circuit().elements[AsSize(other->second)].place));
    }
    circuit().elements.push_back(std::move(element));
    return absl::OkStatus();
  }

  absl::Status AddPassive(const Fields& fields, const Instance& instance, Element element, char kind) {
    const std::string key(1, kind);
    const bool by_name = fields.named.contains(key);
    const std::string form = fmt::format("{}NAME NODE NODE VALUE{}", static_cast<char>(std::toupper(kind)),
                                         kind == 'r' ? "" : " [IC=VALUE]");
    if (absl::Status status = NeedWords(fields, by_name ? 3 : 4, form.c_str()); !status.ok()) return status;
    element.kind = kind == 'r'   ? ElementKind::kResistor
                   : kind == 'c' ? ElementKind::kCapacitor
                                 : ElementKind::kInductor;
    element.plus = NodeOf(instance, fields.words[1].text);
    element.minus = NodeOf(instance, fields.words[2].text);
    const auto value = ValueOf(*fields.line, by_name ? fields.named.at(key) : fields.words[3], *instance.scope);
    if (!value.ok()) return value.status();
    element.value = *value;
    if (!(element.value > 0)) {
      return DeckError(by_name ? fields.line->Place(fields.named.at(key).offset) : fields.Place(3),
                       fmt::format("{} has a value of {:g}; must be above 0{}", element.name, element.value,
                                   kind == 'r' ? " (a voltage source of 0 V is a short)" : ""));
    }
    std::set<std::string> known = {key};
    if (kind != 'r') {
      known.insert("ic");
      if (const auto ic = fields.named.find("ic"); ic != fields.named.end()) {
        const auto initial = ValueOf(*fields.line, ic->second, *instance.scope);
        if (!initial.ok()) return initial.status();
        element.initial = *initial;
      }
    }
    if (absl::Status status = RefuseRest(fields, by_name ? 3 : 4, known); !status.ok()) return status;
    return Store(std::move(element), fields);
  }

  absl::Status AddCoupling(const Fields& fields, const Instance& instance) {
    if (absl::Status status = NeedWords(fields, 4, "KNAME L1 L2 [L3 ...] VALUE"); !status.ok()) return status;
    if (absl::Status status = RefuseRest(fields, fields.words.size(), {}); !status.ok()) return status;
    const auto value = ValueOf(*fields.line, fields.words.back(), *instance.scope);
    if (!value.ok()) return value.status();
    for (std::size_t one = 1; one + 1 < fields.words.size(); ++one) {
      for (std::size_t other = one + 1; other + 1 < fields.words.size(); ++other) {
        pending_couplings_.push_back({instance.prefix + fields.words[0].text, instance.prefix + fields.words[one].text,
                                      instance.prefix + fields.words[other].text, *value, fields.Place(one),
                                      fields.Place(other), fields.Place(fields.words.size() - 1)});
      }
    }
    return absl::OkStatus();
  }

  // --- Sources ---

  absl::Status AddSource(const Fields& fields, const Instance& instance, Element element, char kind) {
    if (absl::Status status = NeedWords(fields, 3, "VNAME NODE NODE VALUE"); !status.ok()) return status;
    element.kind = kind == 'v' ? ElementKind::kVoltageSource : ElementKind::kCurrentSource;
    element.plus = NodeOf(instance, fields.words[1].text);
    element.minus = NodeOf(instance, fields.words[2].text);
    element.source = ConstantWave{0};
    std::size_t k = 3;
    bool has_function = false;
    while (k < fields.words.size()) {
      const std::string word = fields.words[k].is_expression ? "" : Lower(fields.words[k].text);
      if (word == "ac") {
        // Of another analysis: magnitude and phase.
        ++k;
        while (k < fields.words.size() && ReadSpiceNumber(fields.words[k].text)) ++k;
        continue;
      }
      if (word == "dc") {
        if (++k == fields.words.size()) return DeckError(fields.Place(k), "DC needs a value");
      } else if (!word.empty() && std::isalpha(static_cast<unsigned char>(word[0])) != 0 && word != "(") {
        if (has_function) return DeckError(fields.Place(k), fmt::format("{} has two functions", element.name));
        const auto wave = ReadFunction(fields, k, *instance.scope);
        if (!wave.ok()) return wave.status();
        element.source = *wave;
        has_function = true;
        continue;
      }
      const auto value = ValueOf(*fields.line, fields.words[k], *instance.scope);
      if (!value.ok()) return value.status();
      if (!has_function) element.source = ConstantWave{*value};
      ++k;
    }
    if (absl::Status status = RefuseRest(fields, fields.words.size(), {}); !status.ok()) return status;
    if (const std::string fault = FaultOf(element.source); !fault.empty()) {
      return DeckError(fields.line->Place(), fmt::format("{}: {}", element.name, fault));
    }
    return Store(std::move(element), fields);
  }

  // A function with its numbers, in parentheses or without; `k` moves behind it.
  absl::StatusOr<Waveform> ReadFunction(const Fields& fields, std::size_t& k, ParameterScope& scope) {
    const std::size_t begin = k;
    const std::string name = Lower(fields.words[k++].text);
    std::vector<double> values;
    const bool in_parentheses = k < fields.words.size() && fields.words[k].text == "(";
    if (in_parentheses) ++k;
    bool closed = false;
    int inner = 0;  // PWL may have its points in parentheses
    for (; k < fields.words.size(); ++k) {
      const std::string& text = fields.words[k].text;
      if (text == "(") {
        ++inner;
        continue;
      }
      if (text == ")") {
        if (inner-- > 0) continue;
        closed = true;
        ++k;
        break;
      }
      const bool is_word = !fields.words[k].is_expression && std::isalpha(static_cast<unsigned char>(text[0])) != 0;
      if (!in_parentheses && is_word) break;
      const auto value = ValueOf(*fields.line, fields.words[k], scope);
      if (!value.ok()) return value.status();
      values.push_back(*value);
    }
    if (in_parentheses && !closed) return DeckError(fields.Place(begin), fmt::format("{}: \")\" is missing", name));
    return MakeFunction(fields, begin, name, values);
  }

  absl::StatusOr<Waveform> MakeFunction(const Fields& fields, std::size_t begin, const std::string& name,
                                        const std::vector<double>& values) {
    const auto at = [&values](std::size_t k, double otherwise) { return k < values.size() ? values[k] : otherwise; };
    const auto too_many = [&](std::size_t most) {
      return DeckError(fields.Place(begin),
                       fmt::format("{} takes at most {} numbers, not {}", name, most, values.size()));
    };
    const auto too_few = [&](std::size_t least) {
      return DeckError(fields.Place(begin),
                       fmt::format("{} takes at least {} numbers, not {}", name, least, values.size()));
    };
    const double stop = circuit().horizon;
    if (name == "pulse") {
      if (values.size() < 2) return too_few(2);
      if (values.size() == 8) return DeckError(fields.Place(begin), "the number of pulses of PULSE is not supported");
      if (values.size() > 8) return too_many(7);
      PulseWave wave{.low = values[0],
                     .high = values[1],
                     .delay = at(2, 0),
                     .rise = at(3, 0),
                     .fall = at(4, 0),
                     .width = at(5, 0),
                     .period = at(6, 0)};
      std::vector<std::string> defaults;
      const double ramp = options_.ideal_edges ? 0 : deck_.output_step;
      if (wave.rise == 0 && ramp > 0) {
        wave.rise = ramp;
        defaults.push_back(fmt::format("TR = TSTEP = {:g} s", ramp));
      }
      if (wave.fall == 0 && ramp > 0) {
        wave.fall = ramp;
        defaults.push_back(fmt::format("TF = TSTEP = {:g} s", ramp));
      }
      if (wave.width == 0) {
        wave.width = stop;
        defaults.push_back(fmt::format("PW = TSTOP = {:g} s", stop));
      }
      if (wave.period == 0) wave.period = std::numeric_limits<double>::infinity();
      if (wave.rise + wave.width + wave.fall > wave.period * (1 + 1e-6)) {
        Note(fmt::format("{}: PULSE of {}: TR + PW + TF = {:g} s is longer than PER = {:g} s, which cuts it",
                         fields.Place(begin), fields.words[0].text, wave.rise + wave.width + wave.fall, wave.period));
      }
      if (!defaults.empty()) {
        Note(fmt::format("{}: PULSE of {} has {}, as in SPICE{}", fields.Place(begin), fields.words[0].text,
                         fmt::join(defaults, ", "), ramp > 0 ? "; with --ideal-edges missing ramps are jumps" : ""));
      }
      return wave;
    }
    if (name == "sin" || name == "sine") {
      if (values.size() < 2) return too_few(2);
      if (values.size() > 6) return too_many(6);
      return SineWave{.offset = values[0],
                      .amplitude = values[1],
                      .frequency = at(2, 1 / stop),
                      .delay = at(3, 0),
                      .damping = at(4, 0),
                      .phase = at(5, 0)};
    }
    if (name == "exp") {
      if (values.size() < 2) return too_few(2);
      if (values.size() > 6) return too_many(6);
      const double step = deck_.output_step > 0 ? deck_.output_step : stop / 50;
      const double rise_delay = at(2, 0);
      return ExponentialWave{.first = values[0],
                             .second = values[1],
                             .rise_delay = rise_delay,
                             .rise = at(3, step),
                             .fall_delay = at(4, rise_delay + step),
                             .fall = at(5, step)};
    }
    if (name == "sffm") {
      if (values.size() < 2) return too_few(2);
      if (values.size() > 5) return too_many(5);
      return FrequencyModulatedWave{.offset = values[0],
                                    .amplitude = values[1],
                                    .carrier = at(2, 1 / stop),
                                    .index = at(3, 0),
                                    .signal = at(4, 1 / stop)};
    }
    if (name == "pwl") {
      if (values.size() < 2 || values.size() % 2 != 0) {
        return DeckError(fields.Place(begin), "PWL takes pairs of time and value");
      }
      PiecewiseLinearWave wave;
      for (std::size_t k = 0; k < values.size(); k += 2) {
        wave.times.push_back(values[k]);
        wave.values.push_back(values[k + 1]);
      }
      return wave;
    }
    return DeckError(fields.Place(begin),
                     fmt::format("{}: the function {} is not supported; known are PULSE, SIN, PWL, "
                                 "EXP and SFFM",
                                 fields.words[0].text, fields.words[begin].text));
  }

  // --- Controlled sources ---

  absl::Status AddControlled(const Fields& fields, const Instance& instance, Element element, char kind) {
    const bool by_voltage = kind == 'e' || kind == 'g';
    element.kind = kind == 'e'   ? ElementKind::kVcvs
                   : kind == 'g' ? ElementKind::kVccs
                   : kind == 'h' ? ElementKind::kCcvs
                                 : ElementKind::kCccs;
    const char* form = by_voltage ? "ENAME NODE NODE CONTROL+ CONTROL- GAIN" : "FNAME NODE NODE VNAME GAIN";
    if (absl::Status status = NeedWords(fields, 3, form); !status.ok()) return status;
    const std::string next = fields.words.size() > 3 ? Lower(fields.words[3].text) : "";
    if (fields.named.contains("value") || fields.named.contains("cur") || fields.named.contains("vol")) {
      return AddBehavioral(fields, instance, element);
    }
    if (next == "poly" || next == "table" || next == "laplace" || next == "value" || next == "cur" || next == "vol") {
      return DeckError(fields.Place(3),
                       fmt::format("{}: {} is not supported; linear gains, and expressions VALUE={{...}} "
                                   "that are linear, are",
                                   fields.words[0].text, fields.words[3].text));
    }
    if (absl::Status status = NeedWords(fields, by_voltage ? 6 : 5, form); !status.ok()) return status;
    element.plus = NodeOf(instance, fields.words[1].text);
    element.minus = NodeOf(instance, fields.words[2].text);
    const std::size_t gain = by_voltage ? 5 : 4;
    const auto value = ValueOf(*fields.line, fields.words[gain], *instance.scope);
    if (!value.ok()) return value.status();
    element.value = *value;
    if (by_voltage) {
      element.control_plus = NodeOf(instance, fields.words[3].text);
      element.control_minus = NodeOf(instance, fields.words[4].text);
    } else {
      PendControl(instance, fields, 3);
    }
    if (absl::Status status = RefuseRest(fields, gain + 1, {}); !status.ok()) return status;
    return Store(std::move(element), fields);
  }

  // The element stored next is controlled by the current of the voltage source in word `k`.
  void PendControl(const Instance& instance, const Fields& fields, std::size_t k) {
    pending_controls_.push_back(
        {static_cast<Index>(circuit().elements.size()), instance.prefix + fields.words[k].text, fields.Place(k)});
  }

  // A linear expression of voltages and currents: a chain of controlled sources (in series for a voltage, in parallel
  // for a current).
  absl::Status AddBehavioral(const Fields& fields, const Instance& instance, const Element& element) {
    if (absl::Status status = NeedWords(fields, 3, "BNAME NODE NODE V={...} or I={...}"); !status.ok()) return status;
    const char kind = Lower(fields.words[0].text)[0];
    const DeckWord* expression = nullptr;
    bool is_voltage = kind == 'e';
    for (const auto& [name, word] : fields.named) {
      const bool fits = (kind == 'b' && (name == "v" || name == "i")) ||
                        (kind == 'e' && (name == "value" || name == "vol")) ||
                        (kind == 'g' && (name == "value" || name == "cur"));
      if (!fits || expression != nullptr) {
        return DeckError(fields.line->Place(word.offset),
                         fmt::format("{}: {}={} is not supported", fields.words[0].text, name, word.text));
      }
      expression = &word;
      if (kind == 'b') is_voltage = name == "v";
    }
    if (expression == nullptr || fields.words.size() > 3) {
      return DeckError(fields.line->Place(), fmt::format("{} is written {} with an expression in braces",
                                                         fields.words[0].text, "BNAME NODE NODE V={...} or I={...}"));
    }
    const auto value = instance.scope->EvaluateLinear(expression->text);
    if (!value.ok()) {
      return DeckError(fields.line->Place(expression->offset),
                       fmt::format("{}: {}", fields.words[0].text, std::string(value.status().message())));
    }
    return AddLinear(fields, instance, element, is_voltage, *value, expression->offset);
  }

  absl::Status AddLinear(const Fields& fields, const Instance& instance, const Element& whole, bool is_voltage,
                         const LinearValue& value, std::size_t offset) {
    const Index plus = NodeOf(instance, fields.words[1].text), minus = NodeOf(instance, fields.words[2].text);
    Index from = plus;
    std::size_t left = value.factors.size() + 1, number = 0;
    const auto next = [&](Element& part) {
      part.name = whole.name + (number == 0 ? "" : fmt::format("#{}", number));
      part.place = whole.place;
      part.plus = from;
      part.minus = minus;
      if (is_voltage && --left > 0) {
        part.minus = static_cast<Index>(circuit().nodes.size());
        circuit().nodes.push_back(fmt::format("{}#{}", whole.name, number));
      }
      if (is_voltage) from = part.minus;
      ++number;
    };
    for (const auto& [quantity, factor] : value.factors) {
      Element part;
      next(part);
      part.value = factor;
      const std::string inside = quantity.substr(2, quantity.size() - 3);
      if (quantity[0] == 'v') {
        part.kind = is_voltage ? ElementKind::kVcvs : ElementKind::kVccs;
        const std::size_t comma = inside.find(',');
        part.control_plus = NodeOf(instance, inside.substr(0, comma));
        part.control_minus = comma == std::string::npos ? 0 : NodeOf(instance, inside.substr(comma + 1));
      } else {
        part.kind = is_voltage ? ElementKind::kCcvs : ElementKind::kCccs;
        pending_controls_.push_back(
            {static_cast<Index>(circuit().elements.size()), instance.prefix + inside, fields.line->Place(offset)});
      }
      if (absl::Status status = Store(std::move(part), fields); !status.ok()) return status;
    }
    Element part;
    next(part);
    part.kind = is_voltage ? ElementKind::kVoltageSource : ElementKind::kCurrentSource;
    part.source = ConstantWave{value.constant};
    return Store(std::move(part), fields);
  }

  // --- Diodes and switches ---

  const Model* FindModel(const Instance& instance, const std::string& name) const {
    for (const Instance* place = &instance; place != nullptr; place = place->around) {
      const auto found = place->body->models.find(Lower(name));
      if (found != place->body->models.end()) return &found->second;
    }
    return nullptr;
  }

  absl::StatusOr<const Model*> ModelOf(const Fields& fields, std::size_t k, const Instance& instance,
                                       const std::set<std::string>& types) {
    const Model* model = FindModel(instance, fields.words[k].text);
    if (model == nullptr) {
      return DeckError(fields.Place(k),
                       fmt::format("{}: there is no .model {}", fields.words[0].text, fields.words[k].text));
    }
    if (!types.contains(model->type)) {
      return DeckError(fields.Place(k), fmt::format("{}: .model {} is of type {}; must be {}", fields.words[0].text,
                                                    fields.words[k].text, model->type, fmt::join(types, " or ")));
    }
    return model;
  }

  // The numbers of a model: each name must be in `known` or in `ignored`.
  absl::StatusOr<std::map<std::string, double>> ValuesOf(const Model& model, const std::string& name, Instance instance,
                                                         const std::set<std::string>& known,
                                                         const std::set<std::string>& ignored) {
    std::map<std::string, double> values;
    std::vector<std::string> left_out;
    for (const auto& [key, word] : model.values) {
      if (known.contains(key)) {
        const auto value = ValueOf(*model.line, word, *instance.scope);
        if (!value.ok()) return value.status();
        values[key] = *value;
      } else if (ignored.contains(key)) {
        left_out.push_back(key);
      } else {
        return DeckError(model.line->Place(word.offset), fmt::format(".model {}: {} is not supported", name, key));
      }
    }
    if (!left_out.empty()) {
      Note(fmt::format("{}: .model {}: {} {} ignored", model.line->Place(), name, fmt::join(left_out, ", "),
                       left_out.size() == 1 ? "is" : "are"));
    }
    return values;
  }

  absl::Status AddDiode(const Fields& fields, const Instance& instance, Element element) {
    if (absl::Status status = NeedWords(fields, 4, "DNAME ANODE CATHODE MODEL [AREA]"); !status.ok()) return status;
    element.kind = ElementKind::kDiode;
    element.plus = NodeOf(instance, fields.words[1].text);
    element.minus = NodeOf(instance, fields.words[2].text);
    const auto model = ModelOf(fields, 3, instance, {"d"});
    if (!model.ok()) return model.status();
    double area = 1;
    std::size_t used = 4;
    if (fields.words.size() > used && Lower(fields.words[used].text) != "off") {
      const auto given = ValueOf(*fields.line, fields.words[used], *instance.scope);
      if (!given.ok()) return given.status();
      area = *given;
      ++used;
    } else if (const auto named = fields.named.find("area"); named != fields.named.end()) {
      const auto given = ValueOf(*fields.line, named->second, *instance.scope);
      if (!given.ok()) return given.status();
      area = *given;
    }
    if (!(area > 0))
      return DeckError(fields.Place(4), fmt::format("{}: an area of {:g}; must be above 0", element.name, area));
    if (fields.words.size() > used && Lower(fields.words[used].text) == "off") ++used;
    if (absl::Status status = RefuseRest(fields, used, {"area"}); !status.ok()) return status;
    const auto diode = DiodeOf(**model, fields.words[3].text, instance, area);
    if (!diode.ok()) return diode.status();
    element.diode = *diode;
    return Store(std::move(element), fields);
  }

  absl::StatusOr<DiodeModel> DiodeOf(const Model& model, const std::string& name, const Instance& instance,
                                     double area) {
    static const std::set<std::string> kKnown = {"is", "js", "n", "rs", "bv", "vfwd", "vrev", "ron", "roff", "rrev"};
    static const std::set<std::string> kIgnored = {
        "cjo",  "cj0",  "cj",   "vj",   "pb",   "m",       "mj",         "tt",   "fc",   "eg",   "xti",   "kf",   "af",
        "ibv",  "nbv",  "ibvl", "nbvl", "tnom", "tref",    "isr",        "nr",   "ikf",  "ik",   "ikr",   "jsw",  "cjp",
        "cjsw", "php",  "mjsw", "fcs",  "trs1", "trs2",    "tbv1",       "tbv2", "tcv",  "tikf", "level", "vpk",  "ipk",
        "iave", "irms", "diss", "mfg",  "type", "epsilon", "revepsilon", "tcjo", "xtun", "trs",  "pj",    "area", "vp"};
    const auto found = ValuesOf(model, name, instance, kKnown, kIgnored);
    if (!found.ok()) return found.status();
    const std::map<std::string, double>& values = *found;
    const auto at = [&values](const std::string& key, double otherwise) {
      const auto place = values.find(key);
      return place == values.end() ? otherwise : place->second;
    };
    DiodeModel diode;
    const bool is_linear = values.contains("vfwd") || values.contains("ron") || values.contains("roff");
    std::string rule;
    if (options_.diode == DiodeRule::kIdeal) {
      rule = "ideal, as --diode ideal asks";
    } else if (is_linear) {
      diode = {.forward = at("vfwd", 0),
               .on_resistance = at("ron", 1) / area,
               .off_resistance = at("roff", std::numeric_limits<double>::infinity()) / area};
      rule = "from VFWD, RON and ROFF";
    } else {
      const double saturation = at("is", at("js", 1e-14)) * area, slope = at("n", 1) * kThermalVoltage;
      const double current = options_.diode_current;
      if (!(saturation > 0) || !(slope > 0)) {
        return DeckError(model.line->Place(model.offset), fmt::format(".model {}: IS and N must be above 0", name));
      }
      diode.on_resistance = at("rs", 0) / area + slope / current;
      diode.forward = std::max(0.0, slope * (std::log(current / saturation) - 1));
      rule = fmt::format("the tangent at {:g} A", current);
    }
    const double breakdown = at("bv", at("vrev", 0));
    if (breakdown > 0 && std::isfinite(breakdown) && options_.diode != DiodeRule::kIdeal) {
      diode.breakdown = breakdown;
      diode.breakdown_resistance = at("rrev", is_linear ? diode.on_resistance : at("rs", 0) / area);
    }
    std::string note = fmt::format(".model {}: a diode with a forward voltage of {:.6g} V and {:.6g} ohm ({})", name,
                                   diode.forward, diode.on_resistance, rule);
    if (diode.breakdown) {
      note += fmt::format(", breakdown at {:.6g} V with {:.6g} ohm", *diode.breakdown, diode.breakdown_resistance);
    }
    Note(std::move(note));
    return diode;
  }

  absl::Status AddSwitch(const Fields& fields, const Instance& instance, Element element, char kind) {
    const bool by_voltage = kind == 's';
    const std::size_t at = by_voltage ? 5 : 4;
    const char* form =
        by_voltage ? "SNAME NODE NODE CONTROL+ CONTROL- MODEL [ON|OFF]" : "WNAME NODE NODE VNAME MODEL [ON|OFF]";
    if (absl::Status status = NeedWords(fields, at + 1, form); !status.ok()) return status;
    element.kind = ElementKind::kSwitch;
    element.plus = NodeOf(instance, fields.words[1].text);
    element.minus = NodeOf(instance, fields.words[2].text);
    const auto model = ModelOf(fields, at, instance, {by_voltage ? "sw" : "csw"});
    if (!model.ok()) return model.status();
    const auto values = by_voltage
                            ? ValuesOf(**model, fields.words[at].text, instance, {"ron", "roff", "vt", "vh"}, {})
                            : ValuesOf(**model, fields.words[at].text, instance, {"ron", "roff", "it", "ih"}, {});
    if (!values.ok()) return values.status();
    const auto value = [&](const std::string& key, double otherwise) {
      const auto place = values->find(key);
      return place == values->end() ? otherwise : place->second;
    };
    element.switching = {.threshold = value(by_voltage ? "vt" : "it", 0),
                         .hysteresis = value(by_voltage ? "vh" : "ih", 0),
                         .on_resistance = value("ron", 1),
                         .off_resistance = value("roff", std::numeric_limits<double>::infinity())};
    if (by_voltage) {
      element.control_plus = NodeOf(instance, fields.words[3].text);
      element.control_minus = NodeOf(instance, fields.words[4].text);
    } else {
      PendControl(instance, fields, 3);
    }
    std::size_t used = at + 1;
    if (fields.words.size() > used) {
      const std::string word = Lower(fields.words[used].text);
      if (word == "on" || word == "off") {
        element.switching.starts_closed = word == "on";
        ++used;
      }
    }
    if (absl::Status status = RefuseRest(fields, used, {}); !status.ok()) return status;
    return Store(std::move(element), fields);
  }

  // --- Subcircuits ---

  absl::Status AddInstance(const Fields& fields, const Instance& instance) {
    if (absl::Status status = NeedWords(fields, 2, "XNAME NODE ... SUBCKT [NAME=VALUE ...]"); !status.ok())
      return status;
    std::size_t last = fields.words.size() - 1;
    if (const std::string word = Lower(fields.words[last].text); word == "params:" || word == "params") --last;
    const std::string name = Lower(fields.words[last].text);
    const Subcircuit* found = nullptr;
    const Instance* home = &instance;
    for (; home != nullptr; home = home->around) {
      const auto place = home->body->subcircuits.find(name);
      if (place == home->body->subcircuits.end()) continue;
      found = &place->second;
      break;
    }
    if (found == nullptr) {
      return DeckError(fields.Place(last),
                       fmt::format("{}: there is no .subckt {}", fields.words[0].text, fields.words[last].text));
    }
    if (instance.depth >= kMaxSubcircuitDepth) {
      return DeckError(fields.Place(0),
                       fmt::format("{}: subcircuits are nested deeper than {}; does {} contain itself?",
                                   fields.words[0].text, kMaxSubcircuitDepth, found->name));
    }
    if (last - 1 != found->ports.size()) {
      return DeckError(fields.Place(0), fmt::format("{} has {} nodes, but .subckt {} has {}", fields.words[0].text,
                                                    last - 1, found->name, found->ports.size()));
    }
    Instance inner{.prefix = instance.prefix + fields.words[0].text + ".",
                   .body = found->body.get(),
                   .scope = nullptr,
                   .nodes = {},
                   .around = home,
                   .depth = instance.depth + 1};
    for (std::size_t k = 0; k < found->ports.size(); ++k) {
      inner.nodes[found->ports[k]] = NodeOf(instance, fields.words[k + 1].text);
    }
    ParameterScope scope(home->scope);
    inner.scope = &scope;
    if (absl::Status status = GiveParameters(fields, instance, *found, scope); !status.ok()) return status;
    if (absl::Status status = DefineParameters(*found->body, scope); !status.ok()) return status;
    if (expanded_++ > kMaxElements)
      return DeckError(fields.Place(0), fmt::format("more than {} subcircuits after expansion", kMaxElements));
    const absl::Status status = Expand(inner);
    given_.clear();
    return status;
  }

  absl::Status GiveParameters(const Fields& fields, const Instance& instance, const Subcircuit& subcircuit,
                              ParameterScope& scope) {
    std::vector<std::string> own;
    for (std::size_t k = 0; k < subcircuit.defaults.size(); k += 2) own.push_back(Lower(subcircuit.defaults[k].text));
    for (const auto& [name, word] : fields.named) {
      if (std::find(own.begin(), own.end(), name) == own.end() && !HasOwnParameter(*subcircuit.body, name)) {
        return DeckError(fields.line->Place(word.offset), fmt::format("{}: .subckt {} has no parameter {}",
                                                                      fields.words[0].text, subcircuit.name, name));
      }
      const auto value = ValueOf(*fields.line, word, *instance.scope);
      if (!value.ok()) return value.status();
      scope.DefineValue(name, *value);
      given_.insert({&scope, name});
    }
    for (std::size_t k = 0; k < subcircuit.defaults.size(); k += 2) {
      scope.Define(Lower(subcircuit.defaults[k].text), subcircuit.defaults[k + 1].text);
    }
    return absl::OkStatus();
  }

  static bool HasOwnParameter(const Subcircuit::Body& body, const std::string& name) {
    for (const DeckLine* line : body.parameters) {
      const auto definitions = DefinitionsOf(*line, line->text.find_first_of(" \t"));
      if (!definitions.ok()) continue;
      for (const Definition& definition : *definitions) {
        if (Lower(definition.name) == name) return true;
      }
    }
    return false;
  }

  // --- Names that may be used before they are defined ---

  absl::Status ResolveNames() {
    for (const PendingControl& control : pending_controls_) {
      const Index element = ElementNamed(Lower(control.name));
      if (element < 0 || circuit().elements[AsSize(element)].kind != ElementKind::kVoltageSource) {
        return DeckError(control.place,
                         fmt::format("{}: \"{}\" is no voltage source; a current is measured in one (0 V will do)",
                                     circuit().elements[AsSize(control.element)].name, control.name));
      }
      circuit().elements[AsSize(control.element)].control_element = element;
    }
    std::set<std::pair<Index, Index>> coupled;
    for (const PendingCoupling& coupling : pending_couplings_) {
      const auto inductor = [&](const std::string& name) {
        const Index element = ElementNamed(Lower(name));
        return element >= 0 && circuit().elements[AsSize(element)].kind == ElementKind::kInductor ? element : Index{-1};
      };
      const Index one = inductor(coupling.one), other = inductor(coupling.other);
      if (one < 0)
        return DeckError(coupling.one_place, fmt::format("{}: \"{}\" is no inductor", coupling.name, coupling.one));
      if (other < 0)
        return DeckError(coupling.other_place, fmt::format("{}: \"{}\" is no inductor", coupling.name, coupling.other));
      if (one == other)
        return DeckError(coupling.one_place, fmt::format("{} couples {} with itself", coupling.name, coupling.one));
      if (!coupled.insert(std::minmax(one, other)).second) {
        return DeckError(coupling.one_place,
                         fmt::format("{}: {} and {} are coupled twice", coupling.name, coupling.one, coupling.other));
      }
      if (!(std::abs(coupling.value) < 1) || coupling.value == 0) {
        return DeckError(
            coupling.value_place,
            fmt::format("{}: a coupling of {:g}; must be between 0 and 1, without both. 1 is not supported: "
                        "0.9999 leaves a leakage",
                        coupling.name, coupling.value));
      }
      circuit().couplings.push_back({coupling.name, one, other, coupling.value});
    }
    return absl::OkStatus();
  }

  struct PendingControl {
    Index element;
    std::string name, place;
  };
  struct PendingCoupling {
    std::string name, one, other;
    double value;
    std::string one_place, other_place, value_place;
  };

  DeckText text_;
  const DeckOptions options_;
  Deck deck_;
  Subcircuit::Body top_;
  const DeckLine* tran_ = nullptr;
  std::vector<const DeckLine*> initial_, output_lines_;
  std::set<std::string> globals_;
  std::map<std::string, Index> node_names_, element_names_;        // in small letters, with the names of instances
  std::set<std::pair<const ParameterScope*, std::string>> given_;  // by an instance, and so not a second definition
  std::vector<PendingControl> pending_controls_;
  std::vector<PendingCoupling> pending_couplings_;
  std::size_t expanded_ = 0;
};

}  // namespace

absl::StatusOr<Deck> ReadDeck(const std::string& text, const std::string& source, const std::string& folder,
                              const DeckOptions& options) {
  auto lines = SplitDeck(text, source, folder);
  if (!lines.ok()) return lines.status();
  auto deck = DeckReader(*std::move(lines), options).Read();
  if (deck.ok() || std::string(deck.status().message()).find(':') != std::string::npos) return deck;
  return DeckError(source, std::string(deck.status().message()));
}

}  // namespace dlcs::client
