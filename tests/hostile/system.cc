// SPDX-License-Identifier: Apache-2.0

// GCC 12 warns of alternatives of a moved variant that it cannot hold.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif

#include "tests/hostile/system.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

namespace dlcs::hostile {

uint64_t Random::Next() {
  uint64_t z = state_ += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double Random::Uniform(double low, double high) {
  return low + (high - low) * (static_cast<double>(Next() >> 11) * 0x1p-53);
}

// A sum of twelve: near enough, and the same bits everywhere.
double Random::Normal() {
  double sum = -6;
  for (int k = 0; k < 12; ++k) sum += Uniform(0, 1);
  return sum;
}

int Random::Integer(int low, int high) {
  return low + static_cast<int>(Next() % static_cast<uint64_t>(high - low + 1));
}

namespace {

std::string Text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string Argument(const SourceFunction& wave) { return Text(wave.rate) + "*t+(" + Text(wave.phase) + ")"; }

std::string FunctionText(const SourceFunction& function) {
  switch (function.kind) {
    case SourceFunction::Kind::kPower:
      return function.power == 0 ? "1" : function.power == 1 ? "t" : "t**" + std::to_string(function.power);
    case SourceFunction::Kind::kSine:
      return "sin(" + Argument(function) + ")";
    case SourceFunction::Kind::kCosine:
      return "cos(" + Argument(function) + ")";
    case SourceFunction::Kind::kExponential:
      return "exp(" + Text(function.rate) + "*t)";
  }
  return "";
}

std::string KinkText(const System& system, const KinkedTerm& kink) {
  const std::string wave = FunctionText(system.functions[kink.function]);
  switch (kink.kind) {
    case KinkedTerm::Kind::kPositivePart:
      return "max(0, " + wave + ")";
    case KinkedTerm::Kind::kAbsolute:
      return "abs(" + wave + ")";
    case KinkedTerm::Kind::kSign:
      return "sign(" + wave + ")";
    case KinkedTerm::Kind::kAfter:
      return "(t > " + Text(kink.when) + ")";
  }
  return "";
}

std::vector<std::string> Formulas(const System& system, const Eigen::MatrixXd& factors, int first_row) {
  std::vector<std::string> result;
  for (int i = 0; i < factors.rows(); ++i) {
    std::string text;
    const auto add = [&text](double factor, const std::string& function) {
      if (factor == 0) return;
      if (!text.empty()) text += " + ";
      text += function == "1" ? "(" + Text(factor) + ")" : "(" + Text(factor) + ")*" + function;
    };
    for (int k = 0; k < factors.cols(); ++k) add(factors(i, k), FunctionText(system.functions[k]));
    for (const KinkedTerm& kink : system.kinks) {
      if (kink.row == first_row + i) add(kink.factor, KinkText(system, kink));
    }
    result.push_back(text.empty() ? "0" : text);
  }
  return result;
}

// The times in (0, T) where the sine of `kink` is zero, or its own time.
void AddKinkTimes(const System& system, const KinkedTerm& kink, std::vector<Real>& times) {
  if (kink.kind == KinkedTerm::Kind::kAfter) {
    if (kink.when > 0 && kink.when < system.horizon) times.push_back(kink.when);
    return;
  }
  const SourceFunction& wave = system.functions[kink.function];
  const double first = std::floor(wave.phase / M_PI) - 1;
  const double last = std::ceil((wave.rate * system.horizon + wave.phase) / M_PI) + 1;
  for (double k = first; k <= last; ++k) {
    const Real t = (Pi() * Real(k) - Real(wave.phase)) / Real(wave.rate);
    if (t > Real(0) && t < Real(system.horizon)) times.push_back(t);
  }
}

// What `kink` is at `t`, away from its kinks, as a factor of the sine (first) or of 1 (second).
std::pair<double, double> KinkFactors(const System& system, const KinkedTerm& kink, Real t) {
  if (kink.kind == KinkedTerm::Kind::kAfter) return {0, t > Real(kink.when) ? 1 : 0};
  const SourceFunction& wave = system.functions[kink.function];
  const bool positive = Sin(Real(wave.rate) * t + Real(wave.phase)) > Real(0);
  switch (kink.kind) {
    case KinkedTerm::Kind::kPositivePart:
      return {positive ? 1 : 0, 0};
    case KinkedTerm::Kind::kAbsolute:
      return {positive ? 1 : -1, 0};
    default:
      return {0, positive ? 1 : -1};
  }
}

int ConstantFunctionOf(const System& system) {
  for (size_t k = 0; k < system.functions.size(); ++k) {
    if (system.functions[k].kind == SourceFunction::Kind::kPower && system.functions[k].power == 0)
      return static_cast<int>(k);
  }
  return -1;
}

}  // namespace

std::vector<SmoothInterval> SmoothIntervals(const System& system) {
  std::vector<Real> times = {0};
  for (size_t p = 1; p < system.starts.size(); ++p) times.push_back(system.starts[p]);
  for (const KinkedTerm& kink : system.kinks) AddKinkTimes(system, kink, times);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  times.push_back(system.horizon);

  const int one = ConstantFunctionOf(system);
  std::map<std::vector<int>, int> regimes;
  std::vector<SmoothInterval> result;
  for (size_t k = 0; k + 1 < times.size(); ++k) {
    SmoothInterval interval{times[k], times[k + 1], 0, {}, {}};
    const Real middle = (times[k] + times[k + 1]) * Real(0.5);
    int piece = 0;
    while (piece + 1 < static_cast<int>(system.starts.size()) && Real(system.starts[piece + 1]) <= middle) ++piece;
    interval.F = system.F[piece];
    interval.G = system.G[piece];
    std::vector<int> pattern = {piece};
    for (const KinkedTerm& kink : system.kinks) {
      const auto [of_wave, of_one] = KinkFactors(system, kink, middle);
      const int m = system.num_states();
      auto row = kink.row < m ? interval.F.row(kink.row) : interval.G.row(kink.row - m);
      row(kink.function) += of_wave * kink.factor;
      row(one) += of_one * kink.factor;
      pattern.push_back(static_cast<int>(of_wave * 4 + of_one));
    }
    interval.regime = regimes.emplace(pattern, static_cast<int>(regimes.size())).first->second;
    result.push_back(std::move(interval));
  }
  return result;
}

Column SourceValues(const System& system, Real t) {
  Column values;
  for (const SourceFunction& function : system.functions) {
    const Real angle = Real(function.rate) * t + Real(function.phase);
    Real value = 1;
    switch (function.kind) {
      case SourceFunction::Kind::kPower:
        for (int k = 0; k < function.power; ++k) value *= t;
        break;
      case SourceFunction::Kind::kSine:
        value = Sin(angle);
        break;
      case SourceFunction::Kind::kCosine:
        value = Cos(angle);
        break;
      case SourceFunction::Kind::kExponential:
        value = Exp(Real(function.rate) * t);
        break;
    }
    values.push_back(value);
  }
  return values;
}

System Perturbed(const System& system, const std::function<double()>& ulps) {
  System result = system;
  const auto change = [&ulps](double value) { return value == 0 ? 0 : value * (1 + ulps() * 0x1p-52); };
  const auto change_all = [&change](auto& values) {
    for (Index i = 0; i < values.size(); ++i) values.data()[i] = change(values.data()[i]);
  };
  change_all(result.A);
  change_all(result.x0);
  change_all(result.B);
  change_all(result.N);
  if (!system.rank_matters) change_all(result.M);
  for (Eigen::MatrixXd& factors : result.F) change_all(factors);
  for (Eigen::MatrixXd& factors : result.G) change_all(factors);
  for (size_t k = 0; k < result.functions.size(); ++k) {
    SourceFunction& function = result.functions[k];
    if (function.kind == SourceFunction::Kind::kCosine) {
      function.rate = result.functions[k - 1].rate;
      function.phase = result.functions[k - 1].phase;
    } else {
      function.rate = change(function.rate);
      function.phase = change(function.phase);
    }
  }
  for (KinkedTerm& kink : result.kinks) {
    kink.factor = change(kink.factor);
    kink.when = change(kink.when);
  }
  return result;
}

namespace {

std::string OutputName(int index) { return "z" + std::to_string(index); }

}  // namespace

Problem ToProblem(const System& system) {
  Problem problem;
  problem.A = Matrix(system.A);
  problem.B = Matrix(system.B);
  problem.N = Matrix(system.N);
  problem.M = Matrix(system.M);
  problem.x0 = system.x0;
  problem.horizon = system.horizon;
  if (system.num_outputs() > 0) {
    for (int i = 0; i < system.num_outputs(); ++i) problem.outputs.names.push_back(OutputName(i));
    problem.outputs.C = Matrix(system.C);
    problem.outputs.D = Matrix(system.D);
    problem.outputs.h.pieces = {{0, ConstantFunction{Vector::Zero(system.num_outputs())}}};
  }
  for (size_t p = 0; p < system.starts.size(); ++p) {
    problem.f.pieces.push_back({system.starts[p], FormulaFunction{Formulas(system, system.F[p], 0)}});
    problem.g.pieces.push_back({system.starts[p], FormulaFunction{Formulas(system, system.G[p], system.num_states())}});
  }
  return problem;
}

namespace {

std::string Quoted(const std::vector<std::string>& texts) {
  std::string result = "[";
  for (const std::string& text : texts) result += (result.size() > 1 ? ", \"" : "\"") + text + "\"";
  return result + "]";
}

std::string RowText(const Eigen::VectorXd& row) {
  std::string result = "[";
  for (Index j = 0; j < row.size(); ++j) result += (j > 0 ? ", " : "") + Text(row(j));
  return result + "]";
}

std::string MatrixText(const Eigen::MatrixXd& matrix) {
  std::string result = "[";
  for (Index i = 0; i < matrix.rows(); ++i) result += (i > 0 ? ", " : "") + RowText(matrix.row(i));
  return result + "]";
}

}  // namespace

std::string ToJson(const System& system) {
  std::string json =
      "{\"name\": \"hostile " + std::to_string(system.seed) + "\", \"about\": \"" + system.traits + "\",\n";
  json += "\"A\": " + MatrixText(system.A) + ",\n\"B\": " + MatrixText(system.B) + ",\n\"N\": " + MatrixText(system.N) +
          ",\n\"M\": " + MatrixText(system.M) + ",\n\"x0\": " + RowText(system.x0) +
          ",\n\"T\": " + Text(system.horizon) + ",\n";
  if (system.num_outputs() > 0) {
    std::vector<std::string> names;
    for (int i = 0; i < system.num_outputs(); ++i) names.push_back(OutputName(i));
    json += "\"outputs\": {\"names\": " + Quoted(names) + ", \"C\": " + MatrixText(system.C) +
            ", \"D\": " + MatrixText(system.D) + "},\n";
  }
  const auto sources = [&system](size_t p) {
    return "\"f\": " + Quoted(Formulas(system, system.F[p], 0)) +
           ",\n\"g\": " + Quoted(Formulas(system, system.G[p], system.num_states()));
  };
  if (system.starts.size() == 1) return json + sources(0) + "}\n";
  json += "\"pieces\": [";
  for (size_t p = 0; p < system.starts.size(); ++p) {
    json += (p > 0 ? ",\n{\"t0\": " : "{\"t0\": ") + Text(system.starts[p]) + ", " + sources(p) + "}";
  }
  return json + "]}\n";
}

}  // namespace dlcs::hostile
