// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/measurements.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "client/netlist/deck_values.h"
#include "client/netlist/deck_words.h"
#include "client/netlist/spice_number.h"

namespace dlcs::client {
namespace {

// Earlier measurements by their names in small letters; empty for a name that several lines have.
using EarlierNames = std::map<std::string, std::string>;

// A SPICE expression of earlier measurements and parameters as a formula of the engine.
class FormulaMaker {
 public:
  FormulaMaker(std::string_view text, ParameterScope& scope, const EarlierNames& earlier)
      : text_(text), scope_(scope), earlier_(earlier) {}

  absl::StatusOr<std::string> Make() {
    while (at_ < text_.size()) {
      const char letter = text_[at_];
      absl::Status status = absl::OkStatus();
      if (IsDigit(at_) || (letter == '.' && IsDigit(at_ + 1))) {
        status = TakeNumber();
      } else if (IsLetter(at_)) {
        status = TakeName();
      } else if (std::string_view("+-*/(), \t<>=").find(letter) != std::string_view::npos) {
        formula_ += letter;
        ++at_;
      } else {
        status = Fail(letter == '^' ? "^ has two meanings; write ** for a power"
                                    : fmt::format("\"{}\" is not supported", letter));
      }
      if (!status.ok()) return status;
    }
    return formula_;
  }

 private:
  bool IsDigit(std::size_t k) const {
    return k < text_.size() && std::isdigit(static_cast<unsigned char>(text_[k])) != 0;
  }
  bool IsLetter(std::size_t k) const {
    return k < text_.size() && (std::isalpha(static_cast<unsigned char>(text_[k])) != 0 || text_[k] == '_');
  }
  absl::Status Fail(const std::string& why) const { return absl::InvalidArgumentError(why); }

  absl::Status TakeNumber() {
    const std::size_t begin = at_;
    while (IsDigit(at_) || (at_ < text_.size() && text_[at_] == '.')) ++at_;
    if (at_ < text_.size() && (text_[at_] == 'e' || text_[at_] == 'E')) {
      const bool has_sign = at_ + 1 < text_.size() && (text_[at_ + 1] == '+' || text_[at_ + 1] == '-');
      if (IsDigit(at_ + (has_sign ? 2 : 1))) at_ += has_sign ? 2 : 1;
    }
    while (IsDigit(at_) || IsLetter(at_)) ++at_;
    const std::string_view number = text_.substr(begin, at_ - begin);
    const auto value = ReadSpiceNumber(number);
    if (!value) return Fail(fmt::format("\"{}\" is not a number", number));
    formula_ += fmt::format("{:.17g}", *value);
    return absl::OkStatus();
  }

  absl::Status TakeName() {
    static const std::map<std::string, std::string> kFunctions = {
        {"abs", "abs"},   {"sqrt", "sqrt"}, {"exp", "exp"},   {"ln", "log"},    {"log", "log"},   {"log10", "log10"},
        {"min", "min"},   {"max", "max"},   {"sin", "sin"},   {"cos", "cos"},   {"tan", "tan"},   {"asin", "asin"},
        {"acos", "acos"}, {"atan", "atan"}, {"sinh", "sinh"}, {"cosh", "cosh"}, {"tanh", "tanh"}, {"sgn", "sign"}};
    const std::size_t begin = at_;
    while (IsDigit(at_) || IsLetter(at_)) ++at_;
    const std::string name(text_.substr(begin, at_ - begin)), lower = Lower(name);
    const std::size_t next = text_.find_first_not_of(" \t", at_);
    if (next != std::string_view::npos && text_[next] == '(') {
      const auto function = kFunctions.find(lower);
      if (function == kFunctions.end()) {
        return Fail(lower == "v" || lower == "i"
                        ? fmt::format("{}(...) is a curve; PARAM takes numbers, as of FIND ... AT=...", name)
                        : fmt::format("function {} is not supported", name));
      }
      formula_ += function->second;
    } else if (const auto found = earlier_.find(lower); found != earlier_.end()) {
      if (found->second.empty()) return Fail(fmt::format("several measurements are called {}", name));
      formula_ += found->second;
    } else if (const auto value = scope_.Evaluate(name); value.ok()) {
      formula_ += fmt::format("({:.17g})", *value);
    } else {
      return Fail(fmt::format("{} is neither an earlier measurement nor a parameter", name));
    }
    return absl::OkStatus();
  }

  const std::string_view text_;
  ParameterScope& scope_;
  const EarlierNames& earlier_;
  std::size_t at_ = 0;
  std::string formula_;
};

// One line, item by item.
class MeasurementReader {
 public:
  MeasurementReader(const DeckLine& line, double horizon, ParameterScope& scope, const DeckCircuit& circuit,
                    const EarlierNames& earlier, DeckNotes& notes)
      : line_(line),
        items_(ItemsOf(line)),
        horizon_(horizon),
        scope_(scope),
        circuit_(circuit),
        earlier_(earlier),
        notes_(notes) {}

  // In small letters; empty for another analysis, or if it is missing.
  std::string Name() const { return IsOfOtherAnalysis() ? "" : Word(Word(1) == "tran" ? 2 : 1); }

  // Nothing for another analysis.
  absl::StatusOr<std::optional<DeckMeasurement>> Read() {
    if (IsOfOtherAnalysis()) {
      notes_.Add(
          fmt::format("{}: {} {} is ignored: only .tran is solved", line_.Place(), items_[0].text, items_[1].text));
      return std::nullopt;
    }
    at_ = Word(1) == "tran" ? 2 : 1;
    if (at_ >= items_.size()) return Fail("needs a name and what is measured, as in .meas tran mean AVG V(out)");
    made_.measurement.name = items_[at_++].text;
    const absl::Status read = ReadKind();
    if (!read.ok()) return read;
    if (at_ < items_.size()) return Fail(fmt::format("\"{}\" is not supported here", items_[at_].text), at_);
    return std::move(made_);
  }

 private:
  // In small letters; empty after the end.
  std::string Word(std::size_t k) const { return k < items_.size() ? Lower(items_[k].text) : ""; }

  bool IsOfOtherAnalysis() const {
    static const std::set<std::string> kOtherAnalyses = {"ac", "dc", "op", "noise", "sp", "tf", "disto"};
    return kOtherAnalyses.contains(Word(1));
  }

  absl::Status Fail(const std::string& why, std::size_t item = 0) const {
    const std::string place = item < items_.size() ? line_.Place(items_[item].offset) : line_.Place();
    return DeckError(place, made_.measurement.name.empty()
                                ? fmt::format("{} {}", items_[0].text, why)
                                : fmt::format("{} {}: {}", items_[0].text, made_.measurement.name, why));
  }

  absl::Status ReadKind() {
    static const std::map<std::string, MeasurementKind> kOverTime = {
        {"avg", MeasurementKind::kAverage},    {"rms", MeasurementKind::kRms},
        {"integ", MeasurementKind::kIntegral}, {"integral", MeasurementKind::kIntegral},
        {"min", MeasurementKind::kMinimum},    {"max", MeasurementKind::kMaximum},
        {"pp", MeasurementKind::kPeakToPeak}};
    Measurement& measurement = made_.measurement;
    const std::size_t keyword = at_;
    const std::string kind = Word(at_++);
    // MAX(V(out)) is MAX V(out).
    const std::size_t open = kind.find('(');
    if (const auto found = kOverTime.find(kind.substr(0, open));
        open != std::string::npos && found != kOverTime.end()) {
      measurement.kind = found->second;
      const DeckItem& item = items_[keyword];
      auto read = QuantityOf(line_, {item.text.substr(open), item.offset + open}, scope_, circuit_);
      if (!read.ok()) return read.status();
      made_.measured = *std::move(read);
      return TakeWindow();
    }
    if (const auto found = kOverTime.find(kind); found != kOverTime.end()) {
      measurement.kind = found->second;
      if (absl::Status status = TakeQuantity(made_.measured); !status.ok()) return status;
      return TakeWindow();
    }
    if (kind == "param") return TakeFormula();
    if (kind == "find" && Word(at_) == "time" && Word(at_ + 1) == "when") {
      at_ += 2;
      measurement.kind = MeasurementKind::kTime;
      return TakeCondition(measurement.at.emplace(), made_.at);
    }
    if (kind == "find" || kind == "deriv" || kind == "derivative") {
      measurement.kind = kind == "find" ? MeasurementKind::kValue : MeasurementKind::kSlope;
      if (absl::Status status = TakeQuantity(made_.measured); !status.ok()) return status;
      if (Word(at_) == "at") return TakeInstant(measurement.at.emplace(), made_.at);
      if (Word(at_) != "when") {
        return Fail(fmt::format("{} needs AT=time or WHEN quantity=level", items_[keyword].text), at_);
      }
      ++at_;
      return TakeCondition(measurement.at.emplace(), made_.at);
    }
    if (kind == "when") {
      measurement.kind = MeasurementKind::kTime;
      return TakeCondition(measurement.at.emplace(), made_.at);
    }
    if (kind == "trig") {
      measurement.kind = MeasurementKind::kDelay;
      if (absl::Status status = TakeInstant(measurement.at.emplace(), made_.at); !status.ok()) return status;
      if (Word(at_) != "targ") return Fail("TRIG needs TARG", at_);
      ++at_;
      return TakeInstant(measurement.until.emplace(), made_.until);
    }
    const std::string written = keyword < items_.size() ? items_[keyword].text : "";
    if (kind == "min_at" || kind == "max_at") {
      return Fail(
          fmt::format("\"{}\" is not supported; {} shows the time too", written, kind == "min_at" ? "MIN" : "MAX"),
          keyword);
    }
    return Fail(
        fmt::format("\"{}\" is not supported; supported are AVG, RMS, INTEG, MIN, MAX, PP, FIND, DERIV, WHEN, TRIG "
                    "and PARAM",
                    written),
        keyword);
  }

  // PARAM='expression', to the end of the line.
  absl::Status TakeFormula() {
    if (Word(at_) == "=") ++at_;
    if (at_ >= items_.size()) return Fail("PARAM needs an expression");
    const std::size_t begin = items_[at_].offset;
    const std::string text = WithoutBraces(Trimmed(std::string_view(line_.text).substr(begin)));
    auto formula = FormulaMaker(text, scope_, earlier_).Make();
    if (!formula.ok()) return Fail(std::string(formula.status().message()), at_);
    made_.measurement.kind = MeasurementKind::kFormula;
    made_.measurement.formula = *std::move(formula);
    at_ = items_.size();
    return absl::OkStatus();
  }

  absl::Status TakeQuantity(DeckQuantity& quantity) {
    if (at_ >= items_.size()) return Fail("ends before what is measured");
    // Blanks around operators are allowed.
    static const std::string kOperators = "+-*/";
    DeckItem item = items_[at_++];
    for (; at_ < items_.size(); ++at_) {
      const std::string& next = items_[at_].text;
      const bool goes_on =
          kOperators.find(item.text.back()) != std::string::npos || kOperators.find(next.front()) != std::string::npos;
      if (!goes_on || next == "=") break;
      item.text += next;
    }
    auto read = QuantityOf(line_, item, scope_, circuit_);
    if (!read.ok()) return read.status();
    quantity = *std::move(read);
    return absl::OkStatus();
  }

  // "= value" after a keyword, which has been read; LTspice omits "=".
  absl::Status TakeValue(const std::string& keyword, double& value) {
    if (Word(at_) == "=") ++at_;
    if (at_ >= items_.size()) return Fail(fmt::format("expected {}=value", keyword), at_ - 1);
    const DeckItem& item = items_[at_];
    const std::string bare = WithoutBraces(item.text);
    const auto read = ValueOf(line_, {bare, item.offset, bare != item.text}, scope_, notes_);
    if (!read.ok()) return read.status();
    value = *read;
    ++at_;
    return absl::OkStatus();
  }

  absl::Status TakeTime(const std::string& keyword, double& time) {
    const std::size_t item = at_;
    if (absl::Status status = TakeValue(keyword, time); !status.ok()) return status;
    if (time >= 0 && time <= horizon_) return absl::OkStatus();
    return Fail(fmt::format("{}={:g} is outside of 0 to TSTOP = {:g}", keyword, time, horizon_), item);
  }

  // [FROM=time] [TO=time]
  absl::Status TakeWindow() {
    Measurement& measurement = made_.measurement;
    while (Word(at_) == "from" || Word(at_) == "to") {
      const bool is_begin = Word(at_++) == "from";
      double time = 0;
      if (absl::Status status = TakeTime(is_begin ? "FROM" : "TO", time); !status.ok()) return status;
      if (is_begin) {
        measurement.begin = time;
      } else {
        measurement.end = time;
      }
    }
    if (measurement.begin < measurement.end.value_or(horizon_)) return absl::OkStatus();
    return Fail(fmt::format("FROM={:g} is not before {:g}", measurement.begin, measurement.end.value_or(horizon_)));
  }

  // quantity=level or quantity=quantity, and which crossing.
  absl::Status TakeCondition(MeasurementInstant& instant, DeckQuantity& quantity) {
    if (absl::Status status = TakeQuantity(quantity); !status.ok()) return status;
    if (Word(at_) != "=") return Fail("WHEN needs quantity=level", at_);
    if (absl::Status status = TakeLevel(instant, quantity); !status.ok()) return status;
    return TakeCrossing(instant);
  }

  // "=level" or "=quantity".
  absl::Status TakeLevel(MeasurementInstant& instant, DeckQuantity& quantity) {
    if (at_ + 1 >= items_.size()) return Fail("a level is missing after =", at_);
    const std::size_t right = at_ + 1;
    const auto level = scope_.Evaluate(WithoutBraces(items_[right].text));
    if (level.ok()) {
      instant.level = *level;
    } else {
      auto other = QuantityOf(line_, items_[right], scope_, circuit_);
      if (!other.ok()) return other.status();
      if (other->factors.size() > 1 || quantity.factors.size() > 1) {
        return Fail("a product can be compared with a number only", right);
      }
      LinearValue& difference = quantity.factors[0];
      difference.constant -= other->factors[0].constant;
      for (const auto& [name, factor] : other->factors[0].factors) difference.factors[name] -= factor;
      quantity.text += "-" + other->text;
    }
    at_ = right + 1;
    return absl::OkStatus();
  }

  // What follows TRIG or TARG: AT=time, or quantity VAL=level (or quantity=level) and which crossing. For FIND the part
  // AT=time alone.
  absl::Status TakeInstant(MeasurementInstant& instant, DeckQuantity& quantity) {
    if (Word(at_) == "at") {
      ++at_;
      double time = 0;
      if (absl::Status status = TakeTime("AT", time); !status.ok()) return status;
      instant.time = time;
      return absl::OkStatus();
    }
    if (absl::Status status = TakeQuantity(quantity); !status.ok()) return status;
    bool has_level = false;
    if (Word(at_) == "=") {
      if (absl::Status status = TakeLevel(instant, quantity); !status.ok()) return status;
      has_level = true;
    }
    for (;;) {
      if (Word(at_) == "val") {
        ++at_;
        has_level = true;
        if (absl::Status status = TakeValue("VAL", instant.level); !status.ok()) return status;
      } else {
        const std::size_t before = at_;
        if (absl::Status status = TakeCrossing(instant); !status.ok()) return status;
        if (at_ == before) break;
      }
    }
    return has_level ? absl::OkStatus() : Fail("TRIG and TARG need VAL=level", at_);
  }

  // [TD=time] [RISE|FALL|CROSS=number|LAST], in any order.
  absl::Status TakeCrossing(MeasurementInstant& instant) {
    static const std::map<std::string, CrossingDirection> kDirections = {{"rise", CrossingDirection::kRising},
                                                                         {"fall", CrossingDirection::kFalling},
                                                                         {"cross", CrossingDirection::kEither}};
    for (;;) {
      const std::string word = Word(at_);
      if (word == "td") {
        ++at_;
        if (absl::Status status = TakeTime("TD", instant.after); !status.ok()) return status;
        continue;
      }
      const auto direction = kDirections.find(word);
      if (direction == kDirections.end()) return absl::OkStatus();
      const std::size_t keyword = at_++;
      instant.direction = direction->second;
      if (Word(at_) == "=" && Word(at_ + 1) == "last") {
        instant.number = MeasurementInstant::kLast;
        at_ += 2;
        continue;
      }
      double number = 0;
      if (absl::Status status = TakeValue(items_[keyword].text, number); !status.ok()) return status;
      if (!(number >= 1 && number <= 1e9 && number == std::floor(number))) {
        return Fail(fmt::format("{}={:g}; must be 1, 2, ... or LAST", items_[keyword].text, number), keyword);
      }
      instant.number = static_cast<int>(number);
    }
  }

  const DeckLine& line_;
  const std::vector<DeckItem> items_;
  const double horizon_;
  ParameterScope& scope_;
  const DeckCircuit& circuit_;
  const EarlierNames& earlier_;
  DeckNotes& notes_;
  std::size_t at_ = 0;
  DeckMeasurement made_;
};

}  // namespace

absl::StatusOr<std::vector<DeckMeasurement>> ReadMeasurements(const std::vector<const DeckLine*>& lines, double horizon,
                                                              ParameterScope& scope, const DeckCircuit& circuit,
                                                              DeckNotes& notes) {
  std::vector<DeckMeasurement> measurements;
  EarlierNames earlier;
  std::map<std::string, int> uses;  // of names in small letters, by all lines
  std::set<std::string> taken;      // the same names, and those that are made
  for (const DeckLine* line : lines) {
    const std::string name = MeasurementReader(*line, horizon, scope, circuit, earlier, notes).Name();
    ++uses[name];
    taken.insert(name);
  }
  std::map<std::string, int> numbers;
  for (const DeckLine* line : lines) {
    auto read = MeasurementReader(*line, horizon, scope, circuit, earlier, notes).Read();
    if (!read.ok()) return read.status();
    if (!*read) continue;
    std::string& name = (*read)->measurement.name;
    const std::string lower = Lower(name);
    earlier[lower] = uses[lower] > 1 ? "" : name;
    // Other programs print all of them, too.
    if (int& number = numbers[lower]; ++number > 1) {
      std::string other = fmt::format("{}_{}", name, number);
      while (!taken.insert(Lower(other)).second) other = fmt::format("{}_{}", name, ++number);
      notes.Add(fmt::format("{}: another measurement called {}: it becomes {}", line->Place(), name, other));
      name = other;
    }
    measurements.push_back(**std::move(read));
  }
  return measurements;
}

}  // namespace dlcs::client
