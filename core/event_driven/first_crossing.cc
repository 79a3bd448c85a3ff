// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/first_crossing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

// A polynomial on [begin, end] by its Bernstein coefficients there.
struct Piece {
  double begin;
  double end;
  LegendreVector b;
};

// De Casteljau: `piece` becomes its part up to `at`, and the part after it is returned.
Piece CutAt(double at, Piece& piece) {
  const double part = (at - piece.begin) / (piece.end - piece.begin);
  Piece right = piece;
  right.begin = piece.end = at;
  for (Index level = 1; level < kLegendreSize; ++level) {
    // right.b holds the column of averages; its first entries end as the right part's, the firsts as the left part's.
    for (Index i = 0; i < kLegendreSize - level; ++i) right.b[i] = (1 - part) * right.b[i] + part * right.b[i + 1];
    piece.b[level] = right.b[0];
  }
  return right;
}

Piece CutInHalf(Piece& piece) { return CutAt((piece.begin + piece.end) / 2, piece); }

// Whether series + shift is positive by its first coefficient alone, since no P_k exceeds 1.
bool IsClearlyPositive(const LegendreVector& series, double shift) {
  constexpr Index kOperations = kLegendreSize * kLegendreSize;  // of a Bernstein coefficient
  return series[0] + shift > (1 + RoundingOf(kOperations)) * series.tail<kLegendreDegree>().cwiseAbs().sum();
}

bool HasNegative(const LegendreVector& b) { return !(b.minCoeff() >= 0); }

// Positions in [-1, 1] are known so well, to some ulps. Pieces on which series + shift may be negative are not searched
// further if they are shorter; for a quarter of it they would be halved twice more.
constexpr double kShortest = RoundingOf(16);
// The part of a dip that is left to such a search. DipBelowZeroTest feels 4 times as much.
constexpr double kAccuracy = 1.0 / 8;

// Calls settle(piece) for [-1, end], and as long as it returns false for both halves of the piece, the left one first.
// Not at all where no coefficient is negative.
template <typename Settle>
void ForPieces(const LegendreVector& series, double shift, double end, const Settle& settle) {
  if (IsClearlyPositive(series, shift)) return;
  Piece piece{-1, 1, GetLegendreBasis().to_bernstein.transpose() * series};
  piece.b.array() += shift;
  if (!HasNegative(piece.b)) return;
  if (end < 1) CutAt(end, piece);
  // Depth first: `pieces` holds the right halves still to be searched, the nearest last.
  std::array<Piece, 64> pieces;
  std::size_t waiting = 0;
  while (true) {
    if (!settle(piece)) {
      pieces[waiting++] = CutInHalf(piece);
      continue;
    }
    if (waiting == 0) return;
    piece = pieces[--waiting];
  }
}

// Whether the coefficients begin at or above zero and change sign once: the piece has one root, a simple one.
bool FallsOnce(const LegendreVector& b) {
  Index i = 0;
  while (i < kLegendreSize && b[i] >= 0) ++i;
  while (i < kLegendreSize && b[i] <= 0) ++i;
  return i == kLegendreSize && b[kLegendreDegree] < 0;
}
bool RisesOnce(const LegendreVector& b) { return FallsOnce(-b); }

// Newton's method, bisection where it leaves the bracket: positive at `low`, negative at `high`.
double SimpleRoot(const LegendreVector& series, double shift, double low, double high) {
  const LegendreVector slope = DerivativeOf(series);
  double s = (low + high) / 2;
  for (int iteration = 0; iteration < 60; ++iteration) {
    const LegendreVector at_s = LegendreValues(s);
    const double value = series.dot(at_s) + shift;
    (value >= 0 ? low : high) = s;
    double next = s - value / slope.dot(at_s);
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (std::abs(next - s) <= kShortest || !(next > low && next < high)) break;
    s = next;
  }
  return s;
}

}  // namespace

std::optional<double> FirstCrossing(const LegendreVector& series, double shift, double before) {
  if (IsClearlyPositive(series, shift)) return std::nullopt;
  Piece piece{-1, 1, GetLegendreBasis().to_bernstein.transpose() * series};
  piece.b.array() += shift;
  if (!HasNegative(piece.b)) return std::nullopt;
  // Depth first: `pieces` holds the right halves still to be looked at, the nearest last.
  std::array<Piece, 64> pieces;
  std::size_t waiting = 0;
  while (true) {
    if (piece.begin > before) return std::nullopt;
    if (piece.b[0] < 0 || std::isnan(piece.b[0])) return piece.begin;
    if (HasNegative(piece.b)) {
      if (FallsOnce(piece.b)) {
        const double root = SimpleRoot(series, shift, piece.begin, piece.end);
        return root > before ? std::nullopt : std::optional<double>(root);
      }
      if (piece.end - piece.begin < kShortest) return piece.begin;
      pieces[waiting++] = CutInHalf(piece);
      continue;
    }
    if (waiting == 0) return std::nullopt;
    piece = pieces[--waiting];
  }
}

Dip DipBelowZero(const LegendreVector& series, double shift, double end) {
  Dip dip;
  double area = 0;
  ForPieces(series, shift, end, [&](const Piece& piece) {
    const double length = piece.end - piece.begin;
    const double lowest = piece.b.minCoeff();
    dip.depth = NanMax(dip.depth, -std::min(piece.b[0], piece.b[kLegendreDegree]));
    if (!(lowest < 0)) return true;
    const bool is_below = piece.b.maxCoeff() <= 0;
    const bool is_known = -lowest <= (1 + kAccuracy) * dip.depth && (is_below || -lowest * length <= kAccuracy * area);
    if (!is_known && length > kShortest) return false;
    // The mean of a polynomial is that of its Bernstein coefficients.
    area += length * (is_below ? -piece.b.mean() : -lowest / 2);
    return true;
  });
  dip.mean = area / (end + 1);
  return dip;
}

std::vector<PartOfStep> PartsBelowZero(const LegendreVector& series, double shift, double end) {
  std::vector<PartOfStep> parts;
  double below = 0;
  const auto add = [&](double from, double to) {
    below += to - from;
    if (!parts.empty() && parts.back().end == from) {
      parts.back().end = to;
    } else {
      parts.push_back({from, to});
    }
  };
  ForPieces(series, shift, end, [&](const Piece& piece) {
    if (!HasNegative(piece.b)) return true;
    const double length = piece.end - piece.begin;
    if (piece.b.maxCoeff() <= 0) {
      add(piece.begin, piece.end);
    } else if (FallsOnce(piece.b)) {
      add(SimpleRoot(series, shift, piece.begin, piece.end), piece.end);
    } else if (RisesOnce(piece.b)) {
      add(piece.begin, SimpleRoot(-series, -shift, piece.begin, piece.end));
    } else if (length > std::max(kShortest, kAccuracy * below)) {
      return false;
    } else {
      const bool at_end = piece.b[kLegendreDegree] < 0;
      const double middle = piece.begin + length / 2;
      add(at_end ? middle : piece.begin, at_end ? piece.end : middle);
    }
    return true;
  });
  return parts;
}

std::optional<Minimum> LowestMinimum(const LegendreVector& series, double end) {
  constexpr Index kPoints = 2 * kLegendreDegree + 1;
  static const Vector s_of = -(Vector::LinSpaced(kPoints, 0, std::numbers::pi).array().cos().matrix());
  static const LegendreRows at = [] {
    LegendreRows rows;
    LegendreValuesAt(s_of, rows);
    return rows;
  }();
  const Vector values = at * series;
  std::optional<Minimum> lowest;
  for (Index j = 1; j + 1 < kPoints && s_of[j] < end; ++j) {
    if (!(values[j] < values[j - 1] && values[j] <= values[j + 1])) continue;
    const LegendreVector slope = DerivativeOf(series);
    const LegendreVector curvature = DerivativeOf(slope);
    double s = s_of[j];
    for (int iteration = 0; iteration < 5; ++iteration) {
      const LegendreVector at_s = LegendreValues(s);
      const double next = s - slope.dot(at_s) / curvature.dot(at_s);
      if (!(next > s_of[j - 1] && next < s_of[j + 1])) break;
      s = next;
    }
    const LegendreVector at_s = LegendreValues(s);
    const Minimum minimum{series.dot(at_s), curvature.dot(at_s)};
    if (s < end && !(lowest && lowest->value <= minimum.value)) lowest = minimum;
  }
  return lowest;
}

}  // namespace dlcs
