// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/part_of_problem.h"

#include <algorithm>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/mpi/row_exchange.h"

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

Ownership PairsByStates(const Problem& problem, const Ownership& states, MpiTeam& team) {
  const Index n = problem.num_constraints();
  const Ownership blocks = Ownership::Blocks(n, team.size());
  const RowMajorMatrix N = RowsOf(problem.N, blocks, team);
  std::vector<Index> first(static_cast<std::size_t>(N.rows()), states.size());
  for (Index i = 0; i < N.rows(); ++i) {
    for (RowMajorMatrix::InnerIterator entry(N, i); entry; ++entry) {
      if (entry.value() == 0) continue;
      first[static_cast<std::size_t>(i)] = entry.col();
      break;
    }
  }
  const bool lacks_one = std::find(first.begin(), first.end(), states.size()) != first.end();
  if (team.Any(lacks_one)) {
    const RowMajorMatrix columns =
        Transposed(RowsOf(problem.B, states, team), states.rows(team.rank()), states.size(), blocks, team);
    for (Index i = 0; i < columns.rows(); ++i) {
      Index& of_pair = first[static_cast<std::size_t>(i)];
      if (of_pair < states.size()) continue;
      const RowMajorMatrix::InnerIterator entry(columns, i);
      of_pair = entry ? entry.col() : 0;
    }
  }
  // Runs of this block, as numbers that travel: where each begins, and its owner.
  std::vector<double> own;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const int owner = states.owner(first[i]);
    if (!own.empty() && own.back() == owner) continue;
    own.push_back(static_cast<double>(blocks.first(team.rank()) + static_cast<Index>(i)));
    own.push_back(owner);
  }
  std::vector<Ownership::Run> runs;
  const std::vector<double> sizes = team.Gather(static_cast<double>(own.size()));
  for (int rank = 0; rank < team.size(); ++rank) {
    std::vector<double> of_rank = own;
    of_rank.resize(static_cast<std::size_t>(sizes[static_cast<std::size_t>(rank)]));
    team.Share(rank, of_rank.data(), static_cast<Index>(of_rank.size()));
    for (std::size_t k = 0; k < of_rank.size(); k += 2) {
      runs.push_back({static_cast<Index>(of_rank[k]), static_cast<int>(of_rank[k + 1])});
    }
  }
  return Ownership(runs, n, team.size());
}

RowsOfPairs PairsOfRank(const Problem& problem, const Ownership& states, const Ownership& pairs, MpiTeam& team) {
  RowsOfPairs rows{.N = RowsOf(problem.N, pairs, team),
                   .M = RowsOf(problem.M, pairs, team),
                   .columns_of_B = {},
                   .columns_of_M = {},
                   .numbers = pairs.rows(team.rank())};
  rows.columns_of_B = Transposed(RowsOf(problem.B, states, team), states.rows(team.rank()), states.size(), pairs, team);
  rows.columns_of_M = Transposed(rows.M, rows.numbers, pairs.size(), pairs, team);
  return rows;
}

PartOfProblem::PartOfProblem(const Problem& whole, const Ownership& states, const Ownership& pairs, MpiTeam& team)
    : states_(states),
      pairs_(pairs),
      own_states_(states.rows(team.rank())),
      own_pairs_(pairs.rows(team.rank())),
      rows_of_pairs_(PairsOfRank(whole, states, pairs, team)) {
  const auto part_of = [&](const StructuredMatrix& matrix, const Ownership& columns) {
    return std::make_shared<const DistributedMatrix>(RowsOf(matrix, states, team), columns, team);
  };
  const auto of_pairs = [&](const RowMajorMatrix& rows, const Ownership& columns) {
    return StructuredMatrix(std::make_shared<const DistributedMatrix>(rows, columns, team));
  };
  A_ = part_of(whole.A, states);
  B_ = part_of(whole.B, pairs);
  problem_.A = StructuredMatrix(A_);
  problem_.B = StructuredMatrix(B_);
  problem_.N = of_pairs(rows_of_pairs_.N, states);
  problem_.M = of_pairs(rows_of_pairs_.M, pairs);
  if (whole.has_mass()) {
    E_ = part_of(whole.E, states);
    problem_.E = StructuredMatrix(E_);
  }
  problem_.f = ComponentsOf(whole.f, own_states_);
  problem_.g = ComponentsOf(whole.g, own_pairs_);
  problem_.x0 = whole.x0(own_states_);
  problem_.horizon = whole.horizon;
  problem_.break_points = BreakPoints(whole);
  problem_.rule = whole.rule;
}

RowsOfStates PartOfProblem::States() const {
  RowsOfStates rows{
      .A = A_->Rows(states_, own_states_), .B = B_->Rows(pairs_, own_pairs_), .E = {}, .numbers = own_states_};
  if (E_) rows.E = E_->Rows(states_, own_states_);
  return rows;
}

}  // namespace dlcs
