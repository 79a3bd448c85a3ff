// SPDX-License-Identifier: Apache-2.0
#include "tests/plain/plain_trial.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <vector>

#include "core/problem/verdict.h"

namespace dlcs::plain {
namespace {

using Eigen::VectorXd;
using hostile::ComponentError;
using hostile::Judgment;
using hostile::Reference;

// What components stand beside, in the order of ComponentKind: states as the family says, the others by their terms.
std::vector<VectorXd> SizesBeside(const PlainSystem& plain, const Reference& reference) {
  const System& system = plain.system;
  const VectorXd states = reference.size.cwiseMax(plain.beside);
  VectorXd slacks = system.N.cwiseAbs() * states + system.M.cwiseAbs() * reference.size_y;
  for (const Eigen::MatrixXd& G : system.G) slacks = slacks.cwiseMax(G.cwiseAbs().rowwise().sum());
  VectorXd pairs = reference.size_y;
  for (Index i = 0; i < pairs.size(); ++i) {
    if (system.M(i, i) > 0) pairs[i] = std::max(pairs[i], slacks[i] / system.M(i, i));
  }
  const VectorXd outputs = system.C.cwiseAbs() * states + system.D.cwiseAbs() * pairs;
  return {states, pairs, slacks, outputs};
}

// What SOLVED promises of a component.
double Promised(const ComponentError& of, double tolerance) {
  const bool is_small = of.named && of.named->knowledge != Knowledge::kMissed;
  return is_small ? 2 * of.named->rounding : tolerance * of.own;
}

// What a refusal would not be needed below: a component that is negligible beside others is allowed more.
double Tolerated(double own, double beside, double tolerance) {
  return tolerance * (own <= tolerance * beside ? beside : own);
}

// Whether an ulp of the data moves some component by more than is tolerated: of some random ones.
bool DependsOnAnUlp(const PlainSystem& plain, const Reference& reference, const std::vector<VectorXd>& beside,
                    double tolerance) {
  constexpr int kTrials = 4;
  constexpr double kOfSamples = 4;  // signs at random do less than the worst
  Random random(plain.system.seed ^ 0xc0ffee);
  for (int trial = 0; trial < kTrials; ++trial) {
    const System perturbed = hostile::Perturbed(plain.system, [&] { return random.Chance(0.5) ? 1.0 : -1.0; });
    const Reference moved = hostile::Refer(perturbed, reference.times);
    if (moved.status != Reference::Status::kReached) continue;
    const auto moves = [&](const Eigen::MatrixXd& from, const Eigen::MatrixXd& to, const VectorXd& own, size_t kind) {
      for (Index i = 0; i < own.size(); ++i) {
        const double change = (to.row(i) - from.row(i)).cwiseAbs().maxCoeff();
        if (kOfSamples * change > Tolerated(own[i], beside[kind][i], tolerance)) return true;
      }
      return false;
    };
    // y and w may jump within the change of the time of an event.
    if (moves(reference.x, moved.x, reference.size, 0) ||
        moves(reference.outputs, moved.outputs, reference.size_outputs, 3)) {
      return true;
    }
  }
  return false;
}

}  // namespace

PlainTrial TryPlain(const PlainSystem& plain, const Reference& reference, const hostile::Asked& asked, double seconds) {
  constexpr double kOfReference = 1e-28;  // what 106 bits leave of a zero
  PlainTrial trial;
  if (reference.status != Reference::Status::kReached) {
    trial.verdict = reference.reason;
    return trial;
  }
  const auto begin = std::chrono::steady_clock::now();
  const auto solved = hostile::SolveFor(plain.system, hostile::OptionsFor(asked, reference.times, true), seconds);
  trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  trial.judgment = Judgment::kRefused;
  if (!solved.ok()) {
    trial.verdict = std::string(solved.status().message());
    return trial;
  }
  const Verdict verdict = JudgeSolution(*solved);
  trial.verdict = std::string(MethodName(solved->method)) + ": " + verdict.text + ". " + solved->message;
  if (solved->termination != Termination::kReachedEnd) return trial;
  const bool is_solved = verdict.kind == VerdictKind::kSolved;
  const double tolerance = asked.error();
  const std::vector<VectorXd> beside = SizesBeside(plain, reference);
  const auto report = [&trial](const ComponentError& of, double allowed) {
    trial.component = NumberedName(of.component);
    if (of.named && of.named->knowledge != Knowledge::kMissed) trial.component += " (named)";
    trial.error = of.error;
    trial.own = of.own;
    trial.allowed = allowed;
    trial.time = of.time;
  };
  double worst = 0, worst_missed = 0;
  std::optional<ComponentError> missed;
  for (const ComponentError& of : hostile::ErrorsOf(plain.system, *solved, reference, tolerance)) {
    const double size = beside[static_cast<size_t>(of.component.kind)][of.component.index];
    const double allowed = is_solved ? Promised(of, tolerance) : Tolerated(of.own, size, tolerance);
    if (of.named && of.named->knowledge == Knowledge::kMissed) {
      const double excess = (of.named->truncation + of.named->rounding) / of.named->allowed;
      if (!missed || excess > worst_missed) {
        missed = of;
        worst_missed = excess;
      }
    }
    if (of.error <= kOfReference * size) continue;
    const double excess = allowed > 0 ? of.error / allowed : std::numeric_limits<double>::infinity();
    if (is_solved && of.named && of.named->knowledge == Knowledge::kZero && of.error > of.named->rounding) {
      trial.has_rough_zero = true;
    }
    if (excess <= worst) continue;
    worst = excess;
    report(of, allowed);
  }
  if (is_solved) {
    trial.judgment = worst <= 1 ? Judgment::kRight : Judgment::kWrong;
    return trial;
  }
  if (worst <= 1 && missed) report(*missed, missed->named->allowed);
  if (worst > 1) {
    trial.judgment = Judgment::kRefusedWithNeed;
  } else if (DependsOnAnUlp(plain, reference, beside, tolerance)) {
    trial.judgment = Judgment::kRefusedWithNeed;
    trial.an_ulp_decides = true;
  }
  return trial;
}

}  // namespace dlcs::plain
