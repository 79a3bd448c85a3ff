// SPDX-License-Identifier: Apache-2.0
// Random expression trees, written out with as few or as many parentheses as Python's grammar allows, must be
// read back as the same tree: their values agree to the last bit with a direct evaluation of the tree.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/format_number.h"
#include "core/problem/formula.h"

namespace dlcs {
namespace {

struct Node {
  std::string op;  // "number", "t", "pi", "e", "neg", "pos", "+", "-", "*", "/", "**", "chain", or a function
  double number = 0;
  std::vector<std::unique_ptr<Node>> operands;
  std::vector<std::string> comparisons;  // of a chain, between its operands
};

// How tightly a node binds: a comparison least, an atom most.
int Level(const Node& node) {
  if (node.op == "chain") return 0;
  if (node.op == "+" || node.op == "-") return 1;
  if (node.op == "*" || node.op == "/") return 2;
  if (node.op == "neg" || node.op == "pos") return 3;
  if (node.op == "**") return 4;
  return 5;
}

double CompareChain(const std::vector<double>& values, const std::vector<std::string>& comparisons) {
  bool holds = true;
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    const double a = values[i];
    const double b = values[i + 1];
    const std::string& c = comparisons[i];
    holds = holds && (c == "<"    ? a < b
                      : c == "<=" ? a <= b
                      : c == ">"  ? a > b
                      : c == ">=" ? a >= b
                      : c == "==" ? a == b
                                  : a != b);
  }
  return holds;
}

double MinOrMax(const std::vector<double>& values, bool max) {
  double best = values[0];
  for (const double value : values) {
    if (std::isnan(value)) return value;
    if (max ? value > best : value < best) best = value;
  }
  return best;
}

double Value(const Node& node, double t) {
  std::vector<double> v;
  for (const auto& operand : node.operands) v.push_back(Value(*operand, t));
  const std::string& op = node.op;
  if (op == "number") return node.number;
  if (op == "t") return t;
  if (op == "pi") return std::numbers::pi;
  if (op == "e") return std::numbers::e;
  if (op == "neg") return -v[0];
  if (op == "pos") return v[0];
  if (op == "+") return v[0] + v[1];
  if (op == "-") return v[0] - v[1];
  if (op == "*") return v[0] * v[1];
  if (op == "/") return v[0] / v[1];
  if (op == "**") return std::pow(v[0], v[1]);
  if (op == "chain") return CompareChain(v, node.comparisons);
  if (op == "sin") return std::sin(v[0]);
  if (op == "exp") return std::exp(v[0]);
  if (op == "log") return std::log(v[0]);
  if (op == "sqrt") return std::sqrt(v[0]);
  if (op == "abs") return std::fabs(v[0]);
  if (op == "floor") return std::floor(v[0]);
  return MinOrMax(v, op == "max");
}

class Writer {
 public:
  explicit Writer(std::uint64_t seed) : random_(seed) {}

  std::unique_ptr<Node> RandomTree(int depth) {
    auto node = std::make_unique<Node>();
    node->op = depth == 0 ? Pick({"number", "t", "t", "pi", "e"})
                          : Pick({"number", "t",     "neg", "neg", "pos", "+",    "-",   "*",     "/",   "**",
                                  "**",     "chain", "sin", "exp", "log", "sqrt", "abs", "floor", "min", "max"});
    if (node->op == "number") {
      node->number =
          std::strtod(Pick({"0", "1", "2", "3", "0.5", "1e-6", "12.75", "1e3", "0.1", "1e300"}).c_str(), nullptr);
    }
    const int level = Level(*node);
    int operands = 1;
    if (node->op == "number" || node->op == "t" || node->op == "pi" || node->op == "e") operands = 0;
    if (level == 1 || level == 2 || level == 4) operands = 2;
    if (node->op == "chain") operands = 2 + Below(3);
    if (node->op == "min" || node->op == "max") operands = 1 + Below(3);
    for (int i = 0; i < operands; ++i) node->operands.push_back(RandomTree(depth - 1));
    for (int i = 1; node->op == "chain" && i < operands; ++i) {
      node->comparisons.push_back(Pick({"<", "<=", ">", ">=", "==", "!="}));
    }
    return node;
  }

  // `lowest` is the level below which the place asks for parentheses.
  std::string Write(const Node& node, int lowest) {
    std::string text = Blank() + Bare(node) + Blank();
    const int unneeded = Below(8) == 0 ? 1 + Below(2) : 0;
    for (int i = (Level(node) < lowest ? 0 : 1) - unneeded; i < 1; ++i) text = Blank() + "(" + text + ")" + Blank();
    return text;
  }

 private:
  std::string Bare(const Node& node) {
    const std::string& op = node.op;
    if (op == "number") return NumberText(node.number);
    if (node.operands.empty()) return op;
    const auto operand = [&](std::size_t i, int lowest) { return Write(*node.operands[i], lowest); };
    switch (Level(node)) {
      case 0: {
        std::string text = operand(0, 1);
        for (std::size_t i = 1; i < node.operands.size(); ++i) text += node.comparisons[i - 1] + operand(i, 1);
        return text;
      }
      case 1:
        return operand(0, 1) + op + operand(1, 2);
      case 2:
        return operand(0, 2) + op + operand(1, 3);
      case 3:
        return (op == "neg" ? "-" : "+") + operand(0, 3);
      case 4:
        return operand(0, 5) + Pick({"**", "^"}) + operand(1, 3);
      default: {
        std::string text = op + Blank() + "(" + operand(0, 0);
        for (std::size_t i = 1; i < node.operands.size(); ++i) text += "," + operand(i, 0);
        return text + ")";
      }
    }
  }

  std::string Blank() { return Below(6) == 0 ? Pick({" ", "  ", "\n", "\t"}) : ""; }
  int Below(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  std::string Pick(const std::vector<std::string>& choices) {
    return choices[static_cast<std::size_t>(Below(static_cast<int>(choices.size())))];
  }

  std::mt19937_64 random_;
};

TEST(FormulaRandomTest, ReadsBackWhatWasWritten) {
  Writer writer(20240229);
  int finite = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const std::unique_ptr<Node> tree = writer.RandomTree(1 + trial % 5);
    const std::string text = writer.Write(*tree, 0);
    absl::StatusOr<Formula> formula = Formula::Parse(text);
    ASSERT_TRUE(formula.ok()) << text << ": " << formula.status();
    for (const double t : {0.0, 0.3, 1.0, -2.5}) {
      const double expected = Value(*tree, t);
      const double value = formula->Evaluate(t);
      finite += std::isfinite(expected);
      ASSERT_TRUE(value == expected || (std::isnan(value) && std::isnan(expected)))
          << text << " at " << t << ": " << NumberText(value) << " instead of " << NumberText(expected);
    }
  }
  EXPECT_GT(finite, 6000);  // the trees say something
}

// Whatever is typed: a value or an explanation, never a crash.
TEST(FormulaRandomTest, AnswersEveryTextWithAValueOrAPosition) {
  const std::vector<std::string> words = {"t", "pi",   "e", "1", "2.5", "1e-6", ".5", "sin", "min",  "max", "(",  ")",
                                          "(", ")",    "+", "-", "*",   "/",    "**", "^",   "<",    "<=",  "==", ",",
                                          " ", "sin(", "x", "=", "!=",  "\n",   "0",  ">",   "abs(", "-t",  "2*"};
  std::mt19937_64 random(7);
  int accepted = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::string text;
    for (std::uint64_t i = random() % 12; i < 12; ++i) text += words[random() % words.size()];
    absl::StatusOr<Formula> formula = Formula::Parse(text);
    if (formula.ok()) {
      ++accepted;
      formula->Evaluate(0.5);
    } else {
      ASSERT_EQ(formula.status().code(), absl::StatusCode::kInvalidArgument) << text << ": " << formula.status();
      ASSERT_EQ(formula.status().message().substr(0, 12), "at position ") << text;
    }
  }
  EXPECT_GT(accepted, 500);
}

}  // namespace
}  // namespace dlcs
