// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/first_crossing.h"

#include <array>
#include <cmath>

namespace dlcs {
namespace {

// A polynomial on [begin, end] by its Bernstein coefficients there.
struct Piece {
  double begin;
  double end;
  LegendreVector b;
};

// De Casteljau: `piece` becomes its left half, and the right half is returned.
Piece CutInHalf(Piece& piece) {
  Piece right = piece;
  right.begin = piece.end = (piece.begin + piece.end) / 2;
  for (Index level = 1; level < kLegendreSize; ++level) {
    // right.b holds the column of averages; its first entries end as the right half's, the firsts as the left
    // half's.
    for (Index i = 0; i < kLegendreSize - level; ++i) right.b[i] = (right.b[i] + right.b[i + 1]) / 2;
    piece.b[level] = right.b[0];
  }
  return right;
}

bool HasNegative(const LegendreVector& b) { return !(b.minCoeff() >= 0); }

// The crossing in a piece that starts at or above zero and whose coefficients change sign once: a simple
// root.
bool ChangesSignOnce(const LegendreVector& b) {
  Index i = 0;
  while (i < kLegendreSize && b[i] >= 0) ++i;
  while (i < kLegendreSize && b[i] <= 0) ++i;
  return i == kLegendreSize && b[kLegendreDegree] < 0;
}

// Newton's method, bisection where it leaves the bracket: positive at `low`, negative at `high`.
double SimpleRoot(const LegendreVector& series, double shift, double low, double high) {
  const LegendreVector slope = GetLegendreBasis().derivative.transpose() * series;
  double s = (low + high) / 2;
  for (int iteration = 0; iteration < 60; ++iteration) {
    const LegendreVector at_s = LegendreValues(s);
    const double value = series.dot(at_s) + shift;
    (value >= 0 ? low : high) = s;
    double next = s - value / slope.dot(at_s);
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (std::abs(next - s) <= 1e-15 || !(next > low && next < high)) break;
    s = next;
  }
  return s;
}

}  // namespace

std::optional<double> FirstCrossing(const LegendreVector& series, double shift, double before) {
  constexpr double kShortest = 1e-15;
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
      if (ChangesSignOnce(piece.b)) {
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

}  // namespace dlcs
