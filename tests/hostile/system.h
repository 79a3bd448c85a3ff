// SPDX-License-Identifier: Apache-2.0
// A differential linear complementarity system as the generator makes it and the reference reads it: matrices of
// doubles, and sources that are exact sums of powers, waves and exponentials on pieces, so that a mode with its sources
// is x' = A x with a larger A.

#ifndef DLCS_TESTS_HOSTILE_SYSTEM_H_
#define DLCS_TESTS_HOSTILE_SYSTEM_H_

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/problem/problem.h"
#include "tests/hostile/double_double_exp.h"

namespace dlcs::hostile {

// SplitMix64: the same numbers on every machine.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15u + 0x1234567) {}
  uint64_t Next();
  double Uniform(double low, double high);
  double Normal();
  int Integer(int low, int high);  // both inclusive
  bool Chance(double probability) { return Uniform(0, 1) < probability; }

 private:
  uint64_t state_;
};

// One function of time. A system lists them so that their derivatives are sums of those listed: powers from t^0
// upwards, each sine followed by its cosine.
struct SourceFunction {
  enum class Kind { kPower, kSine, kCosine, kExponential };
  Kind kind = Kind::kPower;
  int power = 0;
  double rate = 0;   // ω or λ
  double phase = 0;  // of sine and cosine
};

// A term with kinks or jumps, of one component of f (row < m) or g (row - m).
struct KinkedTerm {
  enum class Kind {
    kPositivePart,
    kAbsolute,
    kSign,
    kAfter
  };  // max(0, s), abs(s), sign(s), (t > when); s the sine `function`
  Kind kind = Kind::kAfter;
  int row = 0;
  double factor = 0;
  int function = 0;
  double when = 0;
};

struct System {
  uint64_t seed = 0;
  std::string traits;  // the classes that it was drawn from
  Eigen::MatrixXd A, B, N, M;
  Eigen::VectorXd x0;
  double horizon = 0;
  Eigen::MatrixXd C, D;  // outputs C x + D y; empty for none

  std::vector<SourceFunction> functions;
  // From starts[p] on (starts[0] = 0) the smooth parts of f and g are F[p] s(t) and G[p] s(t), s the functions.
  std::vector<double> starts;
  std::vector<Eigen::MatrixXd> F, G;
  std::vector<KinkedTerm> kinks;

  bool is_lipschitz = false;   // M is a P-matrix: y is a Lipschitz function of x
  bool least_element = false;  // y is the least element, M a Z-matrix
  bool several_solutions = false;
  bool rank_matters = false;  // M is singular by its exact entries: Perturbed() leaves them

  int num_states() const { return static_cast<int>(A.rows()); }
  int num_pairs() const { return static_cast<int>(M.rows()); }
  int num_outputs() const { return static_cast<int>(C.rows()); }
};

// A interval of time on which f = F s, g = G s, kinks included.
struct SmoothInterval {
  Real begin, end;
  int regime = 0;  // stretches of one regime have the same F and G
  Eigen::MatrixXd F, G;
};
std::vector<SmoothInterval> SmoothIntervals(const System& system);

// The values s(t).
Column SourceValues(const System& system, Real t);

// Each nonzero number of the data times 1 + ulps() 2^-52, those of A first; those of M only where its rank does not
// depend on them.
System Perturbed(const System& system, const std::function<double()>& ulps);

// For the engine, and for its command line.
Problem ToProblem(const System& system);
std::string ToJson(const System& system);

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_SYSTEM_H_
