// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/source_terms.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <string>
#include <utility>
#include <variant>

#include "core/circuits/circuit_branches.h"
#include "core/circuits/linear_network.h"
#include "core/circuits/waveform.h"
#include "core/problem/time_axis.h"

namespace dlcs {
namespace {

struct Use {
  Index source;
  bool is_slope;
};

// The place in `uses` of a gate of the same switch, whose two valves have one gate; -1 if there is none.
Index SameGate(const std::vector<SourceBranch>& sources, Index s, const std::vector<Use>& uses) {
  const SourceBranch& source = sources[AsSize(s)];
  for (std::size_t k = 0; k < uses.size() && source.is_gate; ++k) {
    const SourceBranch& other = sources[AsSize(uses[k].source)];
    if (other.is_gate && other.element == source.element) return static_cast<Index>(k);
  }
  return -1;
}

// Those of `wave` merged into the increasing `cuts`; of times that are equal but for rounding only one.
void AddCuts(const Waveform& wave, double horizon, std::vector<double>& cuts) {
  std::vector<double> all = Cuts(wave, horizon);
  all.insert(all.end(), cuts.begin(), cuts.end());
  std::sort(all.begin(), all.end());
  cuts.clear();
  for (const double cut : all) {
    if (cuts.empty() || cut - cuts.back() > kSameTime * horizon) cuts.push_back(cut);
  }
  cuts.back() = horizon;
}

}  // namespace

TimeFunction FunctionOfSources(const std::vector<SourceBranch>& sources, const Matrix& of_s, const Matrix& of_ds,
                               double horizon) {
  std::vector<Use> uses;
  Vector constant = Vector::Zero(of_s.rows());
  std::vector<Vector> columns;
  for (Index s = 0; s < of_s.cols(); ++s) {
    if (const auto* wave = std::get_if<ConstantWave>(&sources[AsSize(s)].wave)) {
      constant += of_s.col(s) * wave->value;
      continue;
    }
    if (const Index shared = SameGate(sources, s, uses); shared >= 0) {
      columns[AsSize(shared)] += of_s.col(s);
    } else if (!of_s.col(s).isZero(0)) {
      uses.push_back({s, false});
      columns.emplace_back(of_s.col(s));
    }
    if (of_ds.col(s).isZero(0)) continue;
    uses.push_back({s, true});
    columns.emplace_back(of_ds.col(s));
  }
  if (uses.empty()) return TimeFunction::Constant(constant);

  TimeFunction function;
  Matrix lift(constant.size(), static_cast<Index>(uses.size()) + 1);
  lift.col(0) = constant;
  for (std::size_t k = 0; k < uses.size(); ++k) lift.col(static_cast<Index>(k) + 1) = columns[k];
  function.lift = lift;
  std::vector<double> cuts = {0, horizon};
  for (const Use& use : uses) AddCuts(sources[AsSize(use.source)].wave, horizon, cuts);
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    const double inside = cuts[k] + (cuts[k + 1] - cuts[k]) / 2;
    std::vector<std::string> formulas = {"1"};
    for (const Use& use : uses) {
      const Waveform& wave = sources[AsSize(use.source)].wave;
      formulas.push_back(use.is_slope ? DerivativeNear(wave, inside) : FormulaNear(wave, inside));
    }
    TimeFunction::Piece& piece = function.pieces.emplace_back();
    piece.start = cuts[k];
    piece.function.emplace<FormulaFunction>().formulas = std::move(formulas);
  }
  return function;
}

TimeFunction RowsOf(const TimeFunction& function, const Matrix& rows, const Vector& constants) {
  TimeFunction chosen = function;
  if (!function.is_lifted()) {  // constants alone
    for (TimeFunction::Piece& piece : chosen.pieces) {
      Vector& value = std::get<ConstantFunction>(piece.function).value;
      value = (rows * value + constants).eval();
    }
    return chosen;
  }
  // The first function of a lifted one is 1.
  const Eigen::SparseMatrix<double, Eigen::RowMajor> few = rows.sparseView();  // most rows choose one
  Matrix lift = few * function.lift.Dense();
  lift.col(0) += constants;
  const bool has_formulas = std::all_of(
      chosen.pieces.begin(), chosen.pieces.end(),
      [](const TimeFunction::Piece& piece) { return std::holds_alternative<FormulaFunction>(piece.function); });
  if (!has_formulas) {
    chosen.lift = std::move(lift);
    return chosen;
  }
  std::vector<Index> kept = {0};
  for (Index k = 1; k < lift.cols(); ++k) {
    if (!lift.col(k).isZero(0)) kept.push_back(k);
  }
  chosen.lift = Matrix(lift(Eigen::all, kept));
  for (TimeFunction::Piece& piece : chosen.pieces) {
    std::vector<std::string>& formulas = std::get<FormulaFunction>(piece.function).formulas;
    std::vector<std::string> texts;
    for (const Index k : kept) texts.push_back(formulas[static_cast<std::size_t>(k)]);
    formulas = std::move(texts);
  }
  return chosen;
}

}  // namespace dlcs
