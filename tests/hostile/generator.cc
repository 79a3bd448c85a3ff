// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/generator.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/hostile/transforms.h"

namespace dlcs::hostile {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Whether every principal minor is positive beyond doubt, for a few rows.
bool IsPMatrix(const MatrixXd& M) {
  for (unsigned rows = 1; rows < 1u << M.rows(); ++rows) {
    std::vector<int> kept;
    for (int i = 0; i < M.rows(); ++i) {
      if (rows >> i & 1u) kept.push_back(i);
    }
    const MatrixXd minor = M(kept, kept);
    if (!(minor.determinant() > 1e-9 * minor.rowwise().norm().prod())) return false;
  }
  return true;
}

MatrixXd Gaussian(Random& random, int rows, int cols) {
  MatrixXd result(rows, cols);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) result(i, j) = random.Normal();
  }
  return result;
}

// Multiples of 1/2: products of a few are exact, so that what is singular stays so.
MatrixXd Halves(Random& random, int rows, int cols, int largest) {
  MatrixXd result(rows, cols);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) result(i, j) = 0.5 * random.Integer(-largest, largest);
  }
  return result;
}

double LogUniform(Random& random, double low, double high) {
  return std::exp(random.Uniform(std::log(low), std::log(high)));
}

// Products of plane rotations.
MatrixXd Orthogonal(Random& random, int size) {
  MatrixXd result = MatrixXd::Identity(size, size);
  for (int k = 0; k < 2 * size; ++k) {
    const int i = random.Integer(0, size - 1), j = random.Integer(0, size - 1);
    if (i == j) continue;
    const double angle = random.Uniform(0, 2 * M_PI), c = std::cos(angle), s = std::sin(angle);
    const VectorXd row = result.row(i);
    result.row(i) = c * row.transpose() + s * result.row(j);
    result.row(j) = -s * row.transpose() + c * result.row(j);
  }
  return result;
}

enum class Class {
  kPositiveDefinite,
  kNonsymmetricP,
  kNonnegativeP,
  kMMatrix,
  kSingularZ,
  kSemidefinite,
  kSkew,
  kZero,
  kZeroReflection,
  kMixed,
  kMorePairsThanStates,
  kCopositive,
  kIndefinite,
  kNegative,
};
constexpr const char* kClassNames[] = {
    "positive definite M",    "nonsymmetric P", "nonnegative P", "M-matrix",          "singular Z",
    "semidefinite M",         "skew M",         "M = 0",         "M = 0, reflection", "mixed rows",
    "more pairs than states", "copositive M",   "indefinite M",  "N-matrix"};

// Whether B y does work on N x as in a network: then x is unique whatever positive semidefinite M is.
bool IsPassive(Class kind) {
  return kind == Class::kSemidefinite || kind == Class::kSkew || kind == Class::kZero || kind == Class::kMixed ||
         kind == Class::kMorePairsThanStates;
}

bool IsLipschitz(Class kind) {
  return kind == Class::kPositiveDefinite || kind == Class::kNonsymmetricP || kind == Class::kNonnegativeP ||
         kind == Class::kMMatrix;
}

MatrixXd MakeM(Random& random, Class kind, int n) {
  switch (kind) {
    case Class::kPositiveDefinite: {
      const MatrixXd L = Gaussian(random, n, n);
      return L * L.transpose() / n + LogUniform(random, 0.01, 1) * MatrixXd::Identity(n, n);
    }
    case Class::kNonsymmetricP: {  // positive definite with a large skew part, or a triangle
      if (random.Chance(0.5)) {
        const MatrixXd L = Gaussian(random, n, n), K = Gaussian(random, n, n);
        return L * L.transpose() / n + 0.2 * MatrixXd::Identity(n, n) +
               LogUniform(random, 0.3, 10) * (K - K.transpose());
      }
      MatrixXd M = Gaussian(random, n, n) * LogUniform(random, 0.5, 5);
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < i; ++j) M(i, j) = 0;
        M(i, i) = random.Uniform(0.3, 2);
      }
      return M;
    }
    case Class::kNonnegativeP: {  // rows dominated by the diagonal, or nearly
      MatrixXd M = Gaussian(random, n, n).cwiseAbs();
      for (int i = 0; i < n; ++i) M(i, i) = 1.05 * M.row(i).sum();
      return M;
    }
    case Class::kMMatrix: {
      MatrixXd M = -Gaussian(random, n, n).cwiseAbs();
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          if (i != j && random.Chance(0.4)) M(i, j) = 0;
        }
        M(i, i) = 0;
        M(i, i) = -M.row(i).sum() + LogUniform(random, 0.02, 1);
      }
      return M;
    }
    case Class::kSingularZ: {  // rows sum to zero, exactly
      MatrixXd M = -Halves(random, n, n, 3).cwiseAbs();
      for (int i = 0; i < n; ++i) {
        M(i, i) = 0;
        if (n > 1 && M.row(i).sum() == 0) M(i, (i + 1) % n) = -1;
        M(i, i) = -M.row(i).sum() + (random.Chance(0.5) ? 0.5 : 0);
        if (M(i, i) == 0) M(i, i) = 1;
      }
      return M;
    }
    case Class::kSemidefinite: {
      const MatrixXd L = Halves(random, n, std::max(1, random.Integer(n / 2, n - 1)), 4);
      const MatrixXd K = Halves(random, n, n, 2);
      return L * L.transpose() + (random.Chance(0.3) ? 1.0 : 0.0) * (K - K.transpose());
    }
    case Class::kMorePairsThanStates: {
      const MatrixXd L = Halves(random, n, std::max(1, n / 2), 3);
      const MatrixXd K = Halves(random, n, n, 3);
      return random.Chance(0.5) ? MatrixXd(L * L.transpose()) : MatrixXd(K - K.transpose());
    }
    case Class::kSkew: {
      const MatrixXd K = Halves(random, n, n, 4);
      return K - K.transpose();
    }
    case Class::kZero:
    case Class::kZeroReflection:
      return MatrixXd::Zero(n, n);
    case Class::kMixed: {
      const int k = random.Integer(1, n);
      MatrixXd M = MatrixXd::Zero(n, n);
      const MatrixXd L = Gaussian(random, k, k);
      M.topLeftCorner(k, k) = L * L.transpose() / k + 0.3 * MatrixXd::Identity(k, k);
      return M;
    }
    case Class::kCopositive: {
      MatrixXd M = Gaussian(random, n, n).cwiseAbs();
      for (int i = 0; i < n; ++i) M(i, i) *= 0.3;
      return M;
    }
    case Class::kIndefinite: {
      MatrixXd M = Gaussian(random, n, n);
      return M + M.transpose();
    }
    case Class::kNegative: {
      MatrixXd M = -Gaussian(random, n, n).cwiseAbs();
      for (int i = 0; i < n; ++i) M(i, i) -= 0.5;
      return M;
    }
  }
  return {};
}

enum class Dynamics {
  kTame,
  kOscillating,
  kUnstable,
  kDefective,
  kNilpotent,
  kZero,
  kStiffDiagonal,
  kStiffTriangular,
  kGraded,
  kCircuit,
  kStiffRotated,
};
constexpr const char* kDynamicsNames[] = {"tame A",      "oscillating A", "unstable A",       "defective A",
                                          "nilpotent A", "zero A",        "stiff diagonal A", "stiff triangular A",
                                          "graded A",    "circuit A",     "stiff rotated A"};

// `metric` is set to d > 0 if D⁻¹ A is what damps (rows divided by rates or capacities): B = D Nᵀ is then passive.
MatrixXd MakeA(Random& random, Dynamics kind, int m, VectorXd& metric) {
  metric = VectorXd::Ones(m);
  MatrixXd A = MatrixXd::Zero(m, m);
  const MatrixXd G = Gaussian(random, m, m);
  switch (kind) {
    case Dynamics::kTame:
      return G / std::sqrt(m) - random.Uniform(0.3, 1.5) * MatrixXd::Identity(m, m);
    case Dynamics::kOscillating:
      return random.Uniform(0.5, 3) * (G - G.transpose()) / std::sqrt(m) -
             LogUniform(random, 1e-3, 0.3) * MatrixXd::Identity(m, m);
    case Dynamics::kUnstable:
      return G / std::sqrt(m) + random.Uniform(0, 0.5) * MatrixXd::Identity(m, m);
    case Dynamics::kDefective:
      A = MatrixXd::Identity(m, m) * (-0.25 * random.Integer(0, 4));
      for (int i = 0; i + 1 < m; ++i) A(i, i + 1) = random.Chance(0.7) ? 1 : 0;
      return A;
    case Dynamics::kNilpotent:
      for (int i = 0; i < m; ++i) {
        for (int j = i + 1; j < m; ++j) A(i, j) = random.Chance(0.6) ? 0.5 * random.Integer(-2, 2) : 0;
      }
      return A;
    case Dynamics::kZero:
      return A;
    case Dynamics::kStiffDiagonal:
      for (int i = 0; i < m; ++i)
        A(i, i) = random.Chance(0.5) ? -LogUniform(random, 1e6, 1e14) : -LogUniform(random, 1e-3, 3);
      return A;
    case Dynamics::kStiffTriangular: {
      const bool lower = random.Chance(0.5);
      for (int i = 0; i < m; ++i) {
        A(i, i) = random.Chance(0.5) ? -LogUniform(random, 1e4, 1e14) : -LogUniform(random, 1e-3, 3);
        for (int j = 0; j < m; ++j) {
          if (lower ? j < i : j > i) A(i, j) = G(i, j) * std::abs(A(i, i)) * 0.5;  // x_i follows what drives it
        }
      }
      return A;
    }
    case Dynamics::kGraded: {  // fast rows, as scaled by their rates
      VectorXd rates(m);
      for (int i = 0; i < m; ++i) rates(i) = std::pow(10.0, random.Uniform(-1, 8) * (random.Chance(0.6) ? 1 : 0));
      A = G / (2 * std::sqrt(m)) - MatrixXd::Identity(m, m) * 1.5;
      metric = rates;
      return rates.asDiagonal() * A;
    }
    case Dynamics::kCircuit: {  // A = -C⁻¹ G, a connected network of conductances with capacitors of all sizes
      MatrixXd conductance = MatrixXd::Zero(m, m);
      for (int i = 0; i < m; ++i) {
        conductance(i, i) += LogUniform(random, 1e-3, 1);
        const int j = i > 0 ? random.Integer(0, i - 1) : 0;
        if (j == i) continue;
        const double value = LogUniform(random, 1e-2, 10);
        conductance(i, i) += value;
        conductance(j, j) += value;
        conductance(i, j) -= value;
        conductance(j, i) -= value;
      }
      for (int i = 0; i < m; ++i) {
        const double capacity = random.Chance(0.5) ? LogUniform(random, 1e-12, 1e-6) : LogUniform(random, 0.1, 3);
        A.row(i) = -conductance.row(i) / capacity;
        metric(i) = 1 / capacity;
      }
      return A;
    }
    case Dynamics::kStiffRotated: {
      VectorXd rates(m);
      for (int i = 0; i < m; ++i)
        rates(i) = random.Chance(0.5) ? -LogUniform(random, 1e3, 1e7) : -LogUniform(random, 0.01, 3);
      const MatrixXd Q = Orthogonal(random, m);
      return Q * rates.asDiagonal() * Q.transpose();
    }
  }
  return A;
}

bool IsStiff(Dynamics kind) {
  return kind == Dynamics::kStiffDiagonal || kind == Dynamics::kStiffTriangular || kind == Dynamics::kGraded ||
         kind == Dynamics::kCircuit || kind == Dynamics::kStiffRotated;
}

double Round(double value, double unit) { return std::round(value / unit) * unit; }

// The functions of time, T about 1 to 20 in units where they vary in 1.
void MakeFunctions(Random& random, System& system) {
  const auto add = [&system](SourceFunction function) { system.functions.push_back(function); };
  add({});
  if (random.Chance(0.3)) {
    const int degree = random.Integer(1, 3);
    for (int k = 1; k <= degree; ++k) add({SourceFunction::Kind::kPower, k, 0, 0});
  }
  const int waves = random.Integer(0, 3);
  for (int k = 0; k < waves; ++k) {
    const double rate = Round(LogUniform(random, 0.3, 9), 1e-6), phase = Round(random.Uniform(0, 6.28), 1e-3);
    add({SourceFunction::Kind::kSine, 0, rate, phase});
    add({SourceFunction::Kind::kCosine, 0, rate, phase});
  }
  if (random.Chance(0.2)) add({SourceFunction::Kind::kExponential, 0, Round(random.Uniform(-2, 0.1), 1e-3), 0});
}

MatrixXd MakeFactors(Random& random, const System& system, int rows, double size) {
  MatrixXd factors = Gaussian(random, rows, static_cast<int>(system.functions.size())) * size;
  for (Index k = 0; k < factors.cols(); ++k) {
    const SourceFunction& function = system.functions[k];
    if (function.kind == SourceFunction::Kind::kCosine) factors.col(k).setZero();
    if (function.kind == SourceFunction::Kind::kPower) factors.col(k) /= std::pow(system.horizon, function.power);
    for (Index i = 0; i < factors.rows(); ++i) {
      if (random.Chance(0.3)) factors(i, k) = 0;
    }
  }
  return factors;
}

// f and g at 0 from the doubles, near enough to set a consistent start.
VectorXd AtZero(const System& system, const MatrixXd& factors) {
  VectorXd values(static_cast<Index>(system.functions.size()));
  const Column exact = SourceValues(system, 0);
  for (Index k = 0; k < values.size(); ++k) values(k) = ToDouble(exact[k]);
  return factors * values;
}

void AddKinks(Random& random, System& system, bool g_may_jump, bool g_may_kink) {
  std::vector<int> sines;
  for (size_t k = 0; k < system.functions.size(); ++k) {
    if (system.functions[k].kind == SourceFunction::Kind::kSine) sines.push_back(static_cast<int>(k));
  }
  const int count = random.Integer(1, 3);
  for (int k = 0; k < count; ++k) {
    KinkedTerm kink;
    kink.kind = sines.empty() ? KinkedTerm::Kind::kAfter : static_cast<KinkedTerm::Kind>(random.Integer(0, 3));
    const bool jumps = kink.kind == KinkedTerm::Kind::kAfter || kink.kind == KinkedTerm::Kind::kSign;
    const bool in_g = (jumps ? g_may_jump : g_may_kink) && random.Chance(0.4);
    const int m = system.num_states();
    kink.row = in_g ? m + random.Integer(0, system.num_pairs() - 1) : random.Integer(0, m - 1);
    kink.factor = random.Normal();
    if (kink.kind == KinkedTerm::Kind::kAfter) {
      kink.when = Round(random.Uniform(0.05, 0.95) * system.horizon, random.Chance(0.5) ? 0.1 : 1e-9);
    } else {
      kink.function = sines[random.Integer(0, static_cast<int>(sines.size()) - 1)];
    }
    system.kinks.push_back(kink);
  }
  system.traits += ", kinks";
}

void ChangeUnits(Random& random, System& system, Class kind) {
  const int m = system.num_states(), n = system.num_pairs();
  UnitChange units = NoUnitChange(system);
  const auto decades_text = [](int decades) { return "1e±" + std::to_string(decades); };
  if (random.Chance(0.4)) {
    const int decades = random.Integer(1, 8);
    units.states = RandomUnits(random, m, decades, random.Chance(0.5) || system.rank_matters);
    system.traits += ", states in units " + decades_text(decades);
  }
  if (random.Chance(0.25)) {
    const int decades = random.Integer(1, 8);
    const bool powers = random.Chance(0.5) || system.rank_matters;
    units.w = RandomUnits(random, n, decades, powers);
    const bool independent = IsLipschitz(kind) || kind == Class::kSingularZ;
    units.y = independent ? RandomUnits(random, n, decades, powers) : VectorXd(units.w.cwiseInverse());
    system.traits += ", pairs in units " + decades_text(decades);
  }
  if (random.Chance(0.25)) {
    const int decades = random.Integer(1, 9);
    units.time = RandomUnits(random, 1, decades, random.Chance(0.5) || system.rank_matters)(0);
    system.traits += ", time in units " + decades_text(decades);
  }
  system = Rescaled(std::move(system), units);
}

// N and B, so that no mode is unstable at the rate of a fast state: such a system outgrows all numbers.
void MakeCoupling(Random& random, System& system, Class kind, Dynamics dynamics, const VectorXd& metric) {
  const int m = system.num_states(), n = system.num_pairs();
  const VectorXd rates = system.A.rowwise().lpNorm<Eigen::Infinity>().cwiseMax(1.0);
  if (IsPassive(kind)) {
    system.N = kind == Class::kZero || kind == Class::kMixed ? Gaussian(random, n, m) : Halves(random, n, m, 4);
    if (dynamics == Dynamics::kStiffTriangular) {
      for (int i = 0; i < m; ++i) {
        if (rates(i) > 10) system.N.col(i).setZero();
      }
    }
    system.B = metric.asDiagonal() * system.N.transpose();
    return;
  }
  if (kind == Class::kZeroReflection) {  // N B = R with an M-matrix R: the reflection of Harrison and Reiman
    system.N = MatrixXd::Zero(n, m);
    system.N.leftCols(n).setIdentity();
    system.B = Gaussian(random, m, n) * (IsStiff(dynamics) ? 0.0 : 1.0);
    MatrixXd R = MatrixXd::Identity(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        if (i != j) R(i, j) = -random.Uniform(0, 0.9 / n);
      }
    }
    system.B.topRows(n) = R;
    return;
  }
  system.N = Gaussian(random, n, m);
  system.B = Gaussian(random, m, n) * LogUniform(random, 0.1, 1.5);
  if (!IsStiff(dynamics)) return;
  const double gain = 1 + MatrixXd(system.M).fullPivLu().inverse().norm();
  for (int i = 0; i < m; ++i) {
    if (rates(i) < 10) continue;
    if (random.Chance(0.6)) {
      system.B.row(i) *= rates(i);  // fast states move by no less than slow ones
      system.N.col(i) *= random.Chance(0.5) && std::isfinite(gain) ? 0.03 / (n * m * gain) : 0.0;
    } else if (random.Chance(0.5)) {
      system.N.col(i).setZero();
    }
  }
}

}  // namespace

System MakeSystem(uint64_t seed) {
  Random random(seed);
  System system;
  system.seed = seed;
  const Class kind = static_cast<Class>(seed % 14);
  const Dynamics dynamics = static_cast<Dynamics>(random.Integer(0, 10));
  const double size = random.Uniform(0, 1);
  int m = size < 0.5 ? random.Integer(1, 4) : size < 0.9 ? random.Integer(3, 10) : random.Integer(10, 40);
  int n = size < 0.5 ? random.Integer(1, 3) : size < 0.9 ? random.Integer(2, 6) : random.Integer(4, 12);
  switch (kind) {
    case Class::kMorePairsThanStates:
      m = random.Integer(1, 2);
      n = random.Integer(m + 1, 5);
      break;
    case Class::kSemidefinite:
    case Class::kSkew:
    case Class::kMixed:
      n = std::max(n, 2);
      break;
    case Class::kZero:
    case Class::kZeroReflection:
      n = std::min(n, m);
      break;
    case Class::kCopositive:
    case Class::kIndefinite:
    case Class::kNegative:
      n = std::min(n, 4);
      m = std::min(m, 10);
      break;
    default:
      break;
  }
  system.traits = std::string(kClassNames[static_cast<int>(kind)]) + ", " + kDynamicsNames[static_cast<int>(dynamics)];
  system.horizon = Round(LogUniform(random, 0.5, 20), 1e-3);
  system.is_lipschitz = IsLipschitz(kind);
  system.least_element = kind == Class::kSingularZ;
  system.rank_matters = IsPassive(kind) || kind == Class::kSingularZ || kind == Class::kZeroReflection;
  if (dynamics == Dynamics::kUnstable) system.horizon = std::min(system.horizon, 6.0);

  VectorXd metric;
  system.A = MakeA(random, dynamics, m, metric);
  system.M = MakeM(random, kind, n);
  const bool may_have_several = kind == Class::kCopositive || kind == Class::kIndefinite || kind == Class::kNegative;
  system.several_solutions = may_have_several && !IsPMatrix(system.M);
  MakeCoupling(random, system, kind, dynamics, metric);
  system.x0 = random.Chance(0.2) ? VectorXd::Zero(m) : VectorXd(Gaussian(random, m, 1));

  MakeFunctions(random, system);
  system.starts = {0};
  system.F = {MakeFactors(random, system, m, 1)};
  system.G = {MakeFactors(random, system, n, LogUniform(random, 0.3, 3))};
  if (IsStiff(dynamics) && random.Chance(0.6)) {
    for (int i = 0; i < m; ++i) system.F[0].row(i) *= std::max(1.0, system.A.row(i).cwiseAbs().maxCoeff());
  }
  if (!IsLipschitz(kind)) {
    // A consistent start: N x0 + g(0) + M y >= 0 with y of our choice, now and then exactly at its edge.
    const VectorXd q = system.N * system.x0 + AtZero(system, system.G[0]);
    const bool at_edge = random.Chance(0.25);
    for (int i = 0; i < n; ++i) {
      const double slack = at_edge && random.Chance(0.5) ? 0 : std::abs(random.Normal()) * LogUniform(random, 0.05, 2);
      if (q(i) < slack || at_edge) system.G[0](i, 0) += slack - q(i);
    }
    if (at_edge) system.traits += ", starts at the edge";
  } else {
    for (int i = 0; i < n; ++i) system.G[0](i, 0) += 0.5 * random.Normal();
  }
  if (random.Chance(0.2)) {
    const int pieces = random.Integer(2, 4);
    for (int p = 1; p < pieces; ++p) {
      system.starts.push_back(Round(system.horizon * (p + random.Uniform(-0.3, 0.3)) / pieces, 1e-4));
      system.F.push_back(system.F[0] + 0.5 * MakeFactors(random, system, m, 1));
      system.G.push_back(IsLipschitz(kind) ? MatrixXd(system.G[0] + 0.5 * MakeFactors(random, system, n, 1))
                                           : system.G[0]);
    }
    system.traits += ", pieces";
  }
  if (random.Chance(0.25)) AddKinks(random, system, IsLipschitz(kind), true);
  ChangeUnits(random, system, kind);
  return system;
}

}  // namespace dlcs::hostile
