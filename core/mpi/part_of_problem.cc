// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/part_of_problem.h"

#include <memory>
#include <type_traits>
#include <variant>

#include "core/mpi/halo.h"

namespace dlcs {
namespace {

TimePiece ComponentsOf(const TimePiece& piece, const std::vector<Index>& rows) {
  return std::visit(
      [&](auto function) -> TimePiece {
        using Function = decltype(function);
        if constexpr (std::is_same_v<Function, ConstantFunction>) {
          function.value = Vector(function.value(rows));
        } else if constexpr (std::is_same_v<Function, FormulaFunction>) {
          std::vector<std::string> formulas;
          for (const Index row : rows) formulas.push_back(function.formulas[static_cast<std::size_t>(row)]);
          function.formulas = std::move(formulas);
        } else if constexpr (std::is_same_v<Function, SampledFunction>) {
          function.values = Matrix(function.values(rows, Eigen::all));
        } else {
          for (Matrix& coefficients : function.coefficients) coefficients = Matrix(coefficients(rows, Eigen::all));
        }
        return function;
      },
      piece);
}

}  // namespace

TimeFunction ComponentsOf(const TimeFunction& function, const std::vector<Index>& rows) {
  TimeFunction part;
  if (function.is_lifted()) {
    const RowMajorMatrix whole = function.lift.Sparse();
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (RowMajorMatrix::InnerIterator entry(whole, rows[i]); entry; ++entry) {
        entries.emplace_back(static_cast<int>(i), static_cast<int>(entry.col()), entry.value());
      }
    }
    SparseMatrix lift(static_cast<Index>(rows.size()), whole.cols());
    lift.setFromTriplets(entries.begin(), entries.end());
    part.pieces = function.pieces;
    part.lift = std::move(lift);
    return part;
  }
  for (const TimeFunction::Piece& piece : function.pieces) {
    part.pieces.push_back({piece.start, ComponentsOf(piece.function, rows)});
  }
  return part;
}

Problem PartOf(const Problem& problem, const Ownership& states, const Ownership& pairs, MpiTeam& team) {
  const auto part_of = [&](const StructuredMatrix& whole, const Ownership& rows, const Ownership& columns) {
    return StructuredMatrix(std::make_shared<const DistributedMatrix>(whole, rows, columns, team));
  };
  const std::vector<Index>&of_states = states.rows(team.rank()), &of_pairs = pairs.rows(team.rank());
  Problem part;
  part.A = part_of(problem.A, states, states);
  part.B = part_of(problem.B, states, pairs);
  part.N = part_of(problem.N, pairs, states);
  part.M = part_of(problem.M, pairs, pairs);
  if (problem.has_mass()) part.E = part_of(problem.E, states, states);
  part.f = ComponentsOf(problem.f, of_states);
  part.g = ComponentsOf(problem.g, of_pairs);
  part.x0 = problem.x0(of_states);
  part.horizon = problem.horizon;
  part.break_points = BreakPoints(problem);
  part.rule = problem.rule;
  return part;
}

}  // namespace dlcs
